#pragma once

#include <cstdint>
#include <functional>
#include <optional>
#include <stdexcept>
#include <utility>
#include <vector>

#include "core/base/inline_bytes.h"
#include "core/base/time.h"

namespace axlecast {

// What a test does to a line between a driver and a simulator, and sees of it.
class Cable {
 public:
  // Changes what comes from the simulator. Nothing left of it: it is lost.
  using Damage = std::function<void(std::vector<std::uint8_t>& bytes)>;

  void SetDamage(Damage damage) { damage_ = std::move(damage); }
  void Unplug() { plugged_ = false; }
  void Plug() { plugged_ = true; }
  [[nodiscard]] std::int64_t writes() const { return writes_; }  // what the driver sent, or clocked
  [[nodiscard]] std::int64_t waits() const { return waits_; }

 protected:
  Cable() = default;
  ~Cable() = default;

  [[nodiscard]] bool plugged() const { return plugged_; }
  void CountWrite() { ++writes_; }
  // Throws when the driver waits again and again without letting time pass: virtual time would stand still for ever.
  void CountWait(MonoNs now) {
    ++waits_;
    at_one_instant_ = now == last_wait_ ? at_one_instant_ + 1 : 0;
    last_wait_ = now;
    if (at_one_instant_ > kMaxWaits) throw std::runtime_error("the driver turns in circles at one instant");
  }
  // Nothing when it is lost.
  [[nodiscard]] std::optional<std::vector<std::uint8_t>> Damaged(Bytes bytes) const {
    std::vector<std::uint8_t> copy(bytes.begin(), bytes.end());
    if (damage_) damage_(copy);
    if (damage_ && copy.empty()) return std::nullopt;
    return copy;
  }

 private:
  static constexpr int kMaxWaits = 10'000;

  Damage damage_;
  bool plugged_ = true;
  std::int64_t writes_ = 0;
  std::int64_t waits_ = 0;
  MonoNs last_wait_ = 0;
  int at_one_instant_ = 0;
};

}  // namespace axlecast
