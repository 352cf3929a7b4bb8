#pragma once

#include <cstdint>
#include <optional>

#include "core/base/time.h"

namespace axlecast {

// Sees from its state when a device was taken away and another, or the same, answers in its place. Pure.
class ExchangeWatch {
 public:
  enum class Stage : std::uint8_t { kThere, kAway, kBack };

  static constexpr MonoNs kSteady = kSecond;  // it answers for so long without a break: back

  // `state`: device_info_t STATE_*, nothing while its driver is silent. `boot_id` of its driver, 0 unknown: one that
  // restarted may have seen it away.
  void On(std::optional<std::int8_t> state, std::int64_t boot_id, MonoNs now);

  [[nodiscard]] Stage stage() const { return stage_; }

 private:
  Stage stage_ = Stage::kThere;
  std::int64_t boot_id_ = 0;
  MonoNs answers_since_ = kNever;
};

}  // namespace axlecast
