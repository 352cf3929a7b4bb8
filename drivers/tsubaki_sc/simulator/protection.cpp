#include "drivers/tsubaki_sc/simulator/protection.h"

#include <algorithm>
#include <cstdlib>

namespace axlecast::tsubaki_sc::simulator {
namespace {

constexpr MonoNs kTick = 100 * kMillisecond;  // the unit of all times

int SignedValue(std::uint16_t value) { return static_cast<std::int16_t>(value); }

}  // namespace

std::string CauseText(std::uint16_t bits) {
  std::string text;
  for (const Cause& cause : kCauses) {
    if ((bits & cause.bit) != 0) text += (text.empty() ? "" : " ") + std::string(cause.name);
  }
  return text.empty() ? "none" : text;
}

void Protection::Begin(MonoNs now) {
  begun_ = now;
  beyond_since_.fill(kNever);
}

std::uint16_t Protection::JudgePower(std::uint16_t power, const Limits& limits, MonoNs now) {
  const bool starting = now - begun_ < limits.start_time * kTick;
  unsigned causes = 0;
  for (std::size_t i = 0; i < limits.power.size(); ++i) {
    const std::uint16_t limit = limits.power[i];
    const bool beyond = limit != 0 && (i < 2 ? power > limit : power < limit);
    if (starting || !beyond) {
      beyond_since_[i] = kNever;
      continue;
    }
    beyond_since_[i] = std::min(beyond_since_[i], now);
    if (now - beyond_since_[i] >= limits.shock_time[i] * kTick) causes |= 1U << i;
  }
  return static_cast<std::uint16_t>(causes);
}

std::uint16_t Protection::Judge(const Record& record, const Limits& limits, MonoNs now) {
  unsigned causes = JudgePower(record[kPowerIndex], limits, now);
  if (limits.overheat != 0 && SignedValue(record[kTemperatureIndex]) > limits.overheat) causes |= kOverheat;
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const int accel = std::abs(SignedValue(record[kAccelIndex + axis]));
    if (limits.excessive_shock != 0 && accel > limits.excessive_shock) causes |= kExcessiveShock;
  }
  return static_cast<std::uint16_t>(causes);
}

}  // namespace axlecast::tsubaki_sc::simulator
