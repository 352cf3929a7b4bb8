#pragma once

#include <cstddef>
#include <cstdint>
#include <map>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <vector>

#include "core/messages/sequence_count.h"
#include "tools/log/log_reader.h"
#include "tools/log/log_seal.h"

namespace axlecast {

// Checks a log by its events: their numbers and times, the sequence numbers of axlecast's messages, and the seals. Does no I/O.
class LogCheck {
 public:
  struct BadSeal {
    std::size_t offset = 0;  // of the seal's event
    LogSeal sealed;          // the content of the seal
    LogSeal found;           // calculated from the records before it
  };

  // `offset`: of the event in the log. `record`: its bytes.
  void Add(const LogEvent& event, std::size_t offset, Bytes record);

  // Call it after the last event.
  void Finish();

  [[nodiscard]] std::int64_t events() const { return events_; }
  [[nodiscard]] std::int64_t seals() const { return seals_; }
  [[nodiscard]] std::int64_t unsealed() const { return static_cast<std::int64_t>(open_.seal().events); }
  [[nodiscard]] std::int64_t bad_seals() const { return bad_seals_; }
  [[nodiscard]] const std::vector<BadSeal>& first_bad_seals() const { return first_bad_seals_; }
  [[nodiscard]] std::int64_t missing() const { return missing_; }      // events, by gaps in their numbers
  [[nodiscard]] std::int64_t wrong_numbers() const { return wrong_; }  // single numbers that fit neither neighbour
  [[nodiscard]] std::int64_t restarts() const { return restarts_; }    // of the numbers
  [[nodiscard]] std::int64_t backward() const {
    return backward_;
  }  // events that are earlier than their predecessor
  [[nodiscard]] std::int64_t max_backward_us() const { return max_backward_; }
  // Returns the counts of the messages of each channel: those that were lost before they were recorded.
  [[nodiscard]] const std::map<std::string, SequenceCount, std::less<>>& sequences() const { return sequences_; }
  [[nodiscard]] std::int64_t lost() const;

  // Returns true if nothing is missing or contradictory.
  [[nodiscard]] bool sound() const { return bad_seals_ + missing_ + wrong_ + lost() == 0; }

 private:
  void CheckNumber(std::int64_t number);
  void ResolveDoubt(std::optional<std::int64_t> next);
  void CheckSeal(const LogEvent& event, std::size_t offset);

  std::int64_t events_ = 0;
  std::optional<std::int64_t> number_;    // the last accepted number
  std::optional<std::int64_t> doubtful_;  // the number after it, if it did not follow: the next number decides
  std::int64_t missing_ = 0;
  std::int64_t wrong_ = 0;
  std::int64_t restarts_ = 0;
  std::int64_t utime_ = INT64_MIN;
  std::int64_t backward_ = 0;
  std::int64_t max_backward_ = 0;
  SealCount open_;
  std::int64_t seals_ = 0;
  std::int64_t bad_seals_ = 0;
  std::vector<BadSeal> first_bad_seals_;
  std::map<std::string, SequenceCount, std::less<>> sequences_;
};

[[nodiscard]] std::string CheckText(const std::string& file, const LogCheck& check,
                                    const std::vector<LogReader::Damage>& damage);
[[nodiscard]] nlohmann::ordered_json CheckJson(const std::string& file, const LogCheck& check,
                                               const std::vector<LogReader::Damage>& damage);

}  // namespace axlecast
