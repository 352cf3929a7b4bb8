#pragma once

#include <cstddef>
#include <cstdint>
#include <map>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <vector>

#include "core/messages/sequence_count.h"
#include "tools/log/log_event.h"
#include "tools/log/log_reader.h"

namespace axlecast {

// What a log holds, told by its events. Pure.
class LogSummary {
 public:
  struct Channel {
    std::string type;  // of its newest message that is ours; else empty
    std::int64_t count = 0;
    std::uint64_t bytes = 0;  // of its records
    std::int64_t first = 0;   // us, UNIX time, as all times here
    std::int64_t last = 0;
    std::int64_t largest_gap = 0;  // us
    std::int64_t gap_at = 0;       // where it begins
    SequenceCount sequence;        // of messages that are ours
    [[nodiscard]] double Hz() const;
  };

  void Add(const LogEvent& event);

  [[nodiscard]] std::int64_t events() const { return events_; }
  [[nodiscard]] std::int64_t first() const { return first_; }
  [[nodiscard]] std::int64_t last() const { return last_; }
  [[nodiscard]] const std::map<std::string, Channel, std::less<>>& channels() const { return channels_; }
  [[nodiscard]] std::int64_t lost() const;  // messages of ours, by their numbers
  // The text of the newest event on a header's channel.
  [[nodiscard]] std::optional<std::string> Header(std::string_view channel) const;
  // The newest that each recorder said of itself (recorder_health_t), by its channel.
  [[nodiscard]] const std::map<std::string, nlohmann::ordered_json>& recorders() const { return recorders_; }

 private:
  void AddMessage(const LogEvent& event, Channel& channel);

  std::int64_t events_ = 0;
  std::int64_t first_ = 0;
  std::int64_t last_ = 0;
  std::map<std::string, Channel, std::less<>> channels_;
  std::map<std::string, std::string, std::less<>> headers_;
  std::map<std::string, nlohmann::ordered_json> recorders_;
};

// For people: a few lines, and a table of the channels.
[[nodiscard]] std::string SummaryText(const std::string& file, std::size_t bytes, const LogSummary& summary,
                                      const std::vector<LogReader::Damage>& damage);
[[nodiscard]] nlohmann::ordered_json SummaryJson(const std::string& file, std::size_t bytes,
                                                 const LogSummary& summary,
                                                 const std::vector<LogReader::Damage>& damage);

// {"offset": 1234, "bytes": 57} of each.
[[nodiscard]] nlohmann::ordered_json DamageJson(const std::vector<LogReader::Damage>& damage);

// An event as one line of JSON, with its newline: number, received_utime and channel; then a message of ours under its
// type and fields, the text of a header, a seal, or any other event's size and data in hex. `raw`: hex for all.
[[nodiscard]] std::string EventLine(const LogEvent& event, bool raw);

}  // namespace axlecast
