#pragma once

#include <array>

#include "drivers/saa_modbus/answer.h"
#include "drivers/saa_modbus/settings.h"

namespace axlecast::saa_modbus {

// Keeps a late reply from being taken for the answer to a newer request of the same encoder, which has nothing in
// its frames to tell them apart. While an unanswered request may still be answered (`late_us` from its end), no
// request whose reply has the same length is sent. Encoders up to 16 bits may be asked for one register or for two
// (SAA manual 5.1.7: "the reading points could be 01 or 02"), so they are asked for the other number at once; after
// two such requests, and with more bits after one, the encoder is left alone until it can be late no more.
class LateGuard {
 public:
  explicit LateGuard(const SaaModbusSettings& settings) : settings_(settings) {}

  struct Choice {
    int registers = 1;
    MonoNs not_before = 0;
  };
  // How to ask for the position next, and from when on.
  [[nodiscard]] Choice Next(MonoNs now) const;
  void On(const Answer& answer, MonoNs end);
  // The line was closed: what was on its way is gone.
  void Forget() { blocked_until_ = {}; }

 private:
  [[nodiscard]] MonoNs BlockedUntil(int registers) const {
    return blocked_until_.at(static_cast<std::size_t>(registers - 1));
  }

  const SaaModbusSettings& settings_;
  std::array<MonoNs, 2> blocked_until_{};  // of 1 and 2 registers
};

}  // namespace axlecast::saa_modbus
