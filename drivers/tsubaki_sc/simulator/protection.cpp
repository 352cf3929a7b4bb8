#include "drivers/tsubaki_sc/simulator/protection.h"

#include <algorithm>
#include <cmath>
#include <cstdlib>

namespace axlecast::tsubaki_sc::simulator {
namespace {

constexpr std::size_t kStepsPerTick = 10;  // of 10 ms in 0.1 s
static_assert(GearMotor::kStep * static_cast<MonoNs>(kStepsPerTick) == 100 * kMillisecond);

std::uint16_t Unsigned(double value) {
  return static_cast<std::uint16_t>(std::clamp(std::round(value), 0.0, 65535.0));
}
std::uint16_t Signed(double value) {
  return static_cast<std::uint16_t>(static_cast<std::int16_t>(std::clamp(std::round(value), -32768.0, 32767.0)));
}

constexpr MonoNs kTick = 100 * kMillisecond;  // the unit of all times

int SignedValue(std::uint16_t value) { return static_cast<std::int16_t>(value); }

}  // namespace

Record RecordOf(const GearMotor::Reading& reading) {
  Record record{Unsigned(reading.voltage_v * 10), Unsigned(reading.current_a * 1000),
                Unsigned(reading.power_w * 10), Signed(reading.temperature_c * 10)};
  for (std::size_t axis = 0; axis < 3; ++axis) record[kAccelIndex + axis] = Signed(reading.accel_mps2[axis] * 100);
  return record;
}

void History::Add(const Record& record) {
  ring_.resize(kSize);
  ring_[next_] = record;
  next_ = (next_ + 1) % kSize;
  size_ = std::min(size_ + 1, kSize);
}

void History::ReplaceNewest(const Record& record) {
  if (size_ == 0) return Add(record);
  ring_[(next_ + kSize - 1) % kSize] = record;
}

Record History::Before(std::size_t steps) const {
  if (steps >= size_) return {};
  return ring_[(next_ + kSize - 1 - steps) % kSize];
}

void TripLogs::Shift(std::uint16_t factor, const History& history, std::uint16_t interval) {
  std::copy_backward(logs_.begin(), logs_.end() - 1, logs_.end());
  Log& newest = logs_.front();
  newest.factor = factor;
  for (std::size_t i = 0; i < kSamples; ++i) {
    newest.samples[i] = history.Before((kSamples - 1 - i) * interval * kStepsPerTick);
  }
}

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
