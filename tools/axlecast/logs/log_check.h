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

// What can be known of a log's soundness from its events: their numbers and times, the numbers within our own messages,
// and the seals. Pure.
class LogCheck {
 public:
  struct BadSeal {
    std::size_t offset = 0;  // of the seal's event
    LogSeal said;
    LogSeal found;  // what stands before it
  };

  // `offset` and `record`: where it stands, and its bytes.
  void Add(const LogEvent& event, std::size_t offset, Bytes record);

  // Behind the last event.
  void Finish();

  [[nodiscard]] std::int64_t events() const { return events_; }
  [[nodiscard]] std::int64_t seals() const { return seals_; }
  [[nodiscard]] std::int64_t unsealed() const { return static_cast<std::int64_t>(open_.seal().events); }
  [[nodiscard]] std::int64_t bad_seals() const { return bad_seals_; }
  [[nodiscard]] const std::vector<BadSeal>& first_bad_seals() const { return first_bad_seals_; }
  [[nodiscard]] std::int64_t missing() const { return missing_; }            // events, by gaps in their numbers
  [[nodiscard]] std::int64_t wrong_numbers() const { return wrong_; }        // single ones that fit neither side
  [[nodiscard]] std::int64_t new_beginnings() const { return beginnings_; }  // numbers that begin anew
  [[nodiscard]] std::int64_t backward() const { return backward_; }  // events whose time is before the last one's
  [[nodiscard]] std::int64_t most_backward_us() const { return most_backward_; }
  // Messages that were lost before they were recorded, by channel.
  [[nodiscard]] const std::map<std::string, SequenceCount, std::less<>>& sequences() const { return sequences_; }
  [[nodiscard]] std::int64_t lost() const;

  // Nothing is missing and nothing contradicts itself.
  [[nodiscard]] bool sound() const { return bad_seals_ + missing_ + wrong_ + lost() == 0; }

 private:
  void CheckNumber(std::int64_t number);
  void Settle(std::optional<std::int64_t> next);
  void CheckSeal(const LogEvent& event, std::size_t offset);

  std::int64_t events_ = 0;
  std::optional<std::int64_t> number_;    // the last one that is understood
  std::optional<std::int64_t> doubtful_;  // the one behind it, which did not follow: judged by the next
  std::int64_t missing_ = 0;
  std::int64_t wrong_ = 0;
  std::int64_t beginnings_ = 0;
  std::int64_t utime_ = INT64_MIN;
  std::int64_t backward_ = 0;
  std::int64_t most_backward_ = 0;
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
