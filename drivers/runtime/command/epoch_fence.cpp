#include "drivers/runtime/command/epoch_fence.h"

#include <algorithm>

namespace axlecast {

EpochFence::Verdict EpochFence::Judge(std::int64_t bridge_boot_id, std::int64_t bridge_epoch) {
  if (bridge_boot_id != present_) {
    if (std::find(replaced_.begin(), replaced_.end(), bridge_boot_id) != replaced_.end()) return Verdict::kFenced;
    if (bridge_epoch <= newest_) return Verdict::kOlder;
    if (present_ != 0) replaced_.push_back(present_);
    if (replaced_.size() > kRemembered) replaced_.pop_front();
    present_ = bridge_boot_id;
  }
  if (bridge_epoch <= newest_) return Verdict::kOlder;
  newest_ = bridge_epoch;
  return Verdict::kNewest;
}

}  // namespace axlecast
