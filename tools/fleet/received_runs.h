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
class ReceivedRuns {
 public:
  explicit ReceivedRuns(std::string channel) : channel_(std::move(channel)) {}

  // `received`: reception of the message, in us.
  void On(std::int64_t boot_id, std::int64_t seq, std::int64_t received, std::vector<ReceivedRun>& ended);
  // Ends all runs: what was not returned yet goes to `ended`. A message that comes once more later is still known.
  void End(std::vector<ReceivedRun>& ended);

 private:
  // Hostile senders can invent any number of publishers.
  static constexpr std::size_t kMaxPublishers = 64;

  struct Publisher {
    std::int64_t first_seq = 0;  // of the run, of which a part may be returned already
    ReceivedRun run;             // its part that is not returned yet
    bool is_open = true;         // `run` has such a part
  };

  std::string channel_;
  std::map<std::int64_t, Publisher> publishers_;  // by boot_id
};

}  // namespace axlecast
