#pragma once

#include <cstdint>
#include <string_view>

#include "drivers/kit/simulation/shaft.h"
#include "drivers/kit/simulation/simulated_fault.h"
#include "drivers/kit/simulation/unit_simulator.h"

namespace axlecast::saa_modbus {

// One SAA encoder as the manual describes it (4.1, 5.1.7), without its line, and all that a file, a script or an
// operator can set. Address, baud rate, zero and direction survive a power-off.
struct SimulatedEncoder final : TableDevice<SimulatedEncoder> {
  // What the document does not define.
  enum class TwoPoints : std::uint8_t { kPadded, kIgnored };  // up to 16 bits, a request for two registers
  enum class BaudReply : std::uint8_t { kOld, kNew };         // the rate of the reply to a new rate

  explicit SimulatedEncoder(int resolution, std::uint64_t seed = 1) : bits(resolution), random(seed) {}

  void Advance(MonoNs to) override { now = to > now ? to : now; }
  [[nodiscard]] static const QuantityTable<SimulatedEncoder>& Table();
  // Every quantity with its present value, then what the encoder measures and how often its memory was written.
  [[nodiscard]] QuantityList Quantities() const;

  // Returns the position as it would be transmitted now.
  [[nodiscard]] std::uint32_t Position();
  void SetZero() { zero = shaft.At(now).angle; }

  int bits;
  std::uint8_t address = 1;
  std::int64_t baud = 19'200;
  bool negative = false;    // the direction: counts fall counter-clockwise
  ShaftAngle zero = 0;      // shaft angle at which it reads 0
  std::int64_t writes = 0;  // of its memory

  Shaft shaft;
  bool powered = true;
  std::int64_t noise_counts = 0;
  double reply_us = 500;  // from the end of the silent interval to the reply
  bool query_crc_lsb = false;
  TwoPoints two_points = TwoPoints::kPadded;
  BaudReply baud_reply = BaudReply::kOld;
  SimulatedFault fault;
  ShaftAngle stuck_at = 0;

  SeededRandom random;
  MonoNs now = 0;
};

}  // namespace axlecast::saa_modbus
