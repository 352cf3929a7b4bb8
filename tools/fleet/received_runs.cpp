#include "tools/fleet/received_runs.h"

#include <algorithm>
#include <utility>

namespace axlecast {

void ReceivedRuns::On(std::int64_t boot_id, std::int64_t seq, std::int64_t received,
                      std::vector<ReceivedRun>& ended) {
  auto run = open_.find(boot_id);
  if (run != open_.end()) {
    if (seq >= run->second.first_seq && seq <= run->second.last_seq) return;  // received twice
    if (run->second.last_seq != INT64_MAX && seq == run->second.last_seq + 1) {
      run->second.last_seq = seq;
      run->second.t1 = std::max(run->second.t1, received);
      return;
    }
    ended.push_back(std::move(run->second));
    open_.erase(run);
  } else if (open_.size() >= kMaxPublishers) {
    End(ended);
  }
  open_.emplace(boot_id, ReceivedRun{.channel = channel_,
                                     .boot_id = boot_id,
                                     .first_seq = seq,
                                     .last_seq = seq,
                                     .t0 = received,
                                     .t1 = received});
}

void ReceivedRuns::End(std::vector<ReceivedRun>& ended) {
  for (auto& [boot_id, run] : open_) ended.push_back(std::move(run));
  open_.clear();
}

}  // namespace axlecast
