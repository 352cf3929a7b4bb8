#include "tools/axlecast/device_data/exchange_watch.h"

#include <axlecast/device_info_t.hpp>

namespace axlecast {

void ExchangeWatch::On(std::optional<std::int8_t> state, std::int64_t boot_id, MonoNs now) {
  // A new encoder may come with alarms of its own, such as a battery that was never connected: DEGRADED.
  const bool answers = state == device_info_t::STATE_ONLINE || state == device_info_t::STATE_DEGRADED;
  const bool restarted = boot_id != 0 && boot_id_ != 0 && boot_id != boot_id_;
  if (boot_id != 0) boot_id_ = boot_id;
  if (!answers || restarted) {
    stage_ = Stage::kAway;
    answers_since_ = kNever;
  }
  if (!answers) return;
  if (answers_since_ == kNever) answers_since_ = now;
  if (stage_ == Stage::kAway && now - answers_since_ >= kSteady) stage_ = Stage::kBack;
}

}  // namespace axlecast
