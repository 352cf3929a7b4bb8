#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "tools/fleet/rows.h"

namespace axlecast {

// The numbers of one channel's messages as runs without a gap. Every publisher (boot_id) numbers its messages of a channel from 0. The
// database joins runs that continue each other; what is between two runs was sent, and is in no log.
//
// A run also ends with each kPeriodUs of reception time. The runs of a log are therefore the same wherever the reader stopped and
// continued, if it was primed with the messages of the last kPeriodUs.
class ReceivedRuns {
 public:
  static constexpr std::int64_t kPeriodUs = 10'000'000;

  explicit ReceivedRuns(std::string channel) : channel_(std::move(channel)) {}

  // `received`: reception of the message, in us.
  void On(std::int64_t boot_id, std::int64_t seq, std::int64_t received, std::vector<ReceivedRun>& ended);
  // Ends all runs: a period or the log has ended.
  void End(std::vector<ReceivedRun>& ended);

 private:
  // Hostile senders can invent any number of publishers.
  static constexpr std::size_t kMaxPublishers = 64;

  std::string channel_;
  std::map<std::int64_t, ReceivedRun> open_;  // by boot_id
};

}  // namespace axlecast
