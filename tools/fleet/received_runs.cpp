#include "tools/fleet/received_runs.h"

#include <algorithm>
#include <utility>

namespace axlecast {

void ReceivedRuns::On(std::int64_t boot_id, std::int64_t seq, std::int64_t received,
                      std::vector<ReceivedRun>& ended) {
  const auto begin = [&] {
    return ReceivedRun{
        .channel = channel_, .boot_id = boot_id, .first_seq = seq, .last_seq = seq, .t0 = received, .t1 = received};
  };
  const auto known = publishers_.find(boot_id);
  if (known == publishers_.end()) {
    if (publishers_.size() >= kMaxPublishers) {
      End(ended);
      publishers_.clear();
    }
    publishers_.emplace(boot_id, Publisher{.first_seq = seq, .run = begin()});
    return;
  }
  Publisher& publisher = known->second;
  if (seq >= publisher.first_seq && seq <= publisher.run.last_seq) return;  // received twice
  if (publisher.run.last_seq == INT64_MAX || seq != publisher.run.last_seq + 1) {
    if (publisher.is_open) ended.push_back(std::move(publisher.run));
    publisher = {.first_seq = seq, .run = begin()};
  } else if (publisher.is_open) {
    publisher.run.last_seq = seq;
    publisher.run.t1 = std::max(publisher.run.t1, received);
  } else {
    publisher.run = begin();
    publisher.is_open = true;
  }
}

void ReceivedRuns::End(std::vector<ReceivedRun>& ended) {
  for (auto& [boot_id, publisher] : publishers_) {
    if (std::exchange(publisher.is_open, false)) ended.push_back(publisher.run);
  }
}

}  // namespace axlecast
