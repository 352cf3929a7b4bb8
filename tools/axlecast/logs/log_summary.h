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

// Summarizes the content of a log. Does no I/O.
class LogSummary {
 public:
  struct Channel {
    std::string type;  // of its newest message of an axlecast type, else empty
    std::int64_t count = 0;
    std::uint64_t bytes = 0;  // of its records
    std::int64_t first = 0;   // us, UNIX time, like all times of this class
    std::int64_t last = 0;
    std::int64_t largest_gap = 0;  // us
    std::int64_t gap_at = 0;       // start of that gap
    SequenceCount sequence;        // of messages of axlecast's types
    [[nodiscard]] double Hz() const;
  };

  void Add(const LogEvent& event);

  [[nodiscard]] std::int64_t events() const { return events_; }
  [[nodiscard]] std::int64_t first() const { return first_; }
  [[nodiscard]] std::int64_t last() const { return last_; }
  [[nodiscard]] const std::map<std::string, Channel, std::less<>>& channels() const { return channels_; }
  [[nodiscard]] std::int64_t lost() const;  // messages of axlecast's types, by their numbers
  // Returns the text of the newest header event on this channel.
  [[nodiscard]] std::optional<std::string> Header(std::string_view channel) const;
  // Returns the newest health message (recorder_health_t) of each recorder, by channel.
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

// Returns a few lines and a table of the channels.
[[nodiscard]] std::string SummaryText(const std::string& file, std::size_t bytes, const LogSummary& summary,
                                      const std::vector<LogReader::Damage>& damage);
[[nodiscard]] nlohmann::ordered_json SummaryJson(const std::string& file, std::size_t bytes,
                                                 const LogSummary& summary,
                                                 const std::vector<LogReader::Damage>& damage);

// Returns {"offset": 1234, "bytes": 57} for each region.
[[nodiscard]] nlohmann::ordered_json DamageJson(const std::vector<LogReader::Damage>& damage);

// Returns an event as one line of JSON, with the newline. It contains number, received_utime and channel, and then:
// - type and fields of a message of an axlecast type
// - the text of a header event, or the fields of a seal
// - of any other event, and with `raw` of every event: its size, and its data in hex
[[nodiscard]] std::string EventLine(const LogEvent& event, bool raw);

}  // namespace axlecast
