#pragma once

#include <cstdint>
#include <functional>
#include <utility>
#include <vector>

#include "drivers/runtime/core/inline_bytes.h"

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
  void CountWait() { ++waits_; }
  [[nodiscard]] std::vector<std::uint8_t> Damaged(Bytes bytes) const {
    std::vector<std::uint8_t> copy(bytes.begin(), bytes.end());
    if (damage_) damage_(copy);
    return copy;
  }

 private:
  Damage damage_;
  bool plugged_ = true;
  std::int64_t writes_ = 0;
  std::int64_t waits_ = 0;
};

}  // namespace axlecast
