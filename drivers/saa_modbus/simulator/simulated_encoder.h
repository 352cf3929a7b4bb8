#pragma once

#include <cstdint>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "drivers/kit/simulation/script.h"
#include "drivers/kit/simulation/shaft.h"
#include "drivers/kit/simulation/simulated_fault.h"

namespace axlecast::saa_modbus {

// One SAA encoder as the manual describes it (4.1, 5.1.7), behind its line, and all that a file, a script or a
// person can set of it. What it keeps over a power-off: address, baud rate, zero and direction.
struct SimulatedEncoder final : SimulatedDevice {
  // Where the document is silent.
  enum class TwoPoints : std::uint8_t { kPadded, kIgnored };  // up to 16 bits, asked for two registers
  enum class BaudReply : std::uint8_t { kOld, kNew };         // at which rate the reply to a new rate comes

  explicit SimulatedEncoder(int resolution, std::uint64_t seed = 1) : bits(resolution), random(seed) {}

  void Advance(MonoNs to) override { now = to > now ? to : now; }
  [[nodiscard]] Result<> Set(std::string_view name, std::string_view value) override;  // of QuantityNames()

  // The position as it would be transmitted now.
  [[nodiscard]] std::uint32_t Position();
  void SetZero();

  int bits;
  std::uint8_t address = 1;
  std::int64_t baud = 19'200;
  bool negative = false;    // the direction: counts fall counter-clockwise
  ShaftAngle zero = 0;      // shaft angle at which it reads 0
  std::int64_t writes = 0;  // of its memory

  Shaft shaft;
  std::string motion = "constant";
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

// The names that SimulatedEncoder::Set takes, in the order in which a mapping of several is applied.
[[nodiscard]] const std::vector<std::string_view>& QuantityNames();

// Every quantity with its present value, then what the encoder measures and what was done to it.
[[nodiscard]] std::vector<std::pair<std::string, std::string>> Quantities(const SimulatedEncoder& encoder);

}  // namespace axlecast::saa_modbus
