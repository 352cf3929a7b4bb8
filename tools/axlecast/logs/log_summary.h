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

// The content of a log. All times are in us, UNIX time.
struct LogSummary {
  struct Channel {
    std::string type;  // of its newest message of an axlecast type, else empty
    std::int64_t count = 0;
    std::uint64_t bytes = 0;  // of its records
    std::int64_t first = 0;
    std::int64_t last = 0;
    std::int64_t largest_gap = 0;  // us
    std::int64_t gap_at = 0;       // start of that gap
    SequenceCount sequence;        // of messages of axlecast's types
    [[nodiscard]] double Hz() const;
  };

  std::int64_t events = 0;
  std::int64_t first = 0;
  std::int64_t last = 0;
  std::map<std::string, Channel, std::less<>> channels;
  std::map<std::string, std::string, std::less<>>
      headers;  // text of the newest header event of each kind, by channel
  std::map<std::string, nlohmann::ordered_json> recorders;  // newest recorder_health_t of each recorder, by channel

  void Add(const LogEvent& event);
  [[nodiscard]] std::int64_t Lost() const;  // messages of axlecast's types, by their numbers
  [[nodiscard]] std::optional<std::string> Header(std::string_view channel) const;

 private:
  void AddMessage(const LogEvent& event, Channel& channel);
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
