#pragma once

#include <cstddef>
#include <cstdint>
#include <map>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <vector>

#include "core/base/time.h"
#include "core/messages/sequence_count.h"
#include "tools/axlecast/common/on_base.h"
#include "tools/log/log_event.h"
#include "tools/log/log_reader.h"

namespace axlecast {

// Checks a log by its events: their numbers and times, the sequence numbers of axlecast's messages, and the seals. Does no I/O.
class LogCheck {
 public:
  struct BadSeal {
    std::size_t offset = 0;  // of the seal's event
    LogSeal sealed;          // the content of the seal
    LogSeal found;           // calculated from the records before it
  };
  struct Report {
    std::int64_t events = 0;
    std::int64_t seals = 0;
    std::int64_t unsealed = 0;  // events after the last seal
    std::int64_t bad_seals = 0;
    std::vector<BadSeal> first_bad_seals;
    std::int64_t missing = 0;        // events, by gaps in their numbers
    std::int64_t wrong_numbers = 0;  // single numbers that fit neither neighbour
    std::int64_t restarts = 0;       // of the numbers
    std::int64_t backward = 0;       // events that are earlier than their predecessor
    std::int64_t max_backward_us = 0;
    // The messages of each channel: the lost ones were lost before they were recorded.
    std::map<std::string, SequenceCount, std::less<>> sequences;

    [[nodiscard]] std::int64_t Lost() const;
    // Returns true if nothing is missing or contradictory.
    [[nodiscard]] bool IsSound() const { return bad_seals + missing + wrong_numbers + Lost() == 0; }
  };

  // `offset`: of the event in the log. `record`: its bytes.
  void Add(const LogEvent& event, std::size_t offset, Bytes record);

  // Returns the result. Call it after the last event.
  [[nodiscard]] const Report& Finish();

 private:
  void CheckNumber(std::int64_t number);
  void ResolveDoubt(std::optional<std::int64_t> next);
  void CheckSeal(const LogEvent& event, std::size_t offset);

  Report report_;
  std::optional<std::int64_t> number_;    // the last accepted number
  std::optional<std::int64_t> doubtful_;  // the number after it, if it did not follow: the next number decides
  std::int64_t utime_ = INT64_MIN;
  SealCount open_;
};

[[nodiscard]] std::string CheckText(const std::string& file, const LogCheck::Report& report,
                                    const std::vector<LogReader::Damage>& damage);
[[nodiscard]] nlohmann::ordered_json CheckJson(const std::string& file, const LogCheck::Report& report,
                                               const std::vector<LogReader::Damage>& damage);

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
};

// Returns a few lines and a table of the channels.
[[nodiscard]] std::string SummaryText(const std::string& file, std::size_t bytes, const LogSummary& summary,
                                      const std::vector<LogReader::Damage>& damage);
[[nodiscard]] nlohmann::ordered_json SummaryJson(const std::string& file, std::size_t bytes,
                                                 const LogSummary& summary,
                                                 const std::vector<LogReader::Damage>& damage);

// Returns {"offset": 1234, "bytes": 57} for each region.
[[nodiscard]] nlohmann::ordered_json DamageJson(const std::vector<LogReader::Damage>& damage);

// Returns when an event was received, for OnBase: the clock of a log.
[[nodiscard]] MonoNs ArrivalOf(const LogEvent& event);

// Returns an event as one line of JSON, with the newline. It contains number, received_utime and channel, and then:
// - type and fields of a message of an axlecast type, and its instant on the time base as far as `base` knows it
// - the text of a header event, or the fields of a seal
// - of any other event, and with `raw` of every event: its size, and its data in hex
[[nodiscard]] std::string EventLine(const LogEvent& event, bool raw, const OnBase& base = {});

}  // namespace axlecast
