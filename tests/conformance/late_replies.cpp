#include "tests/conformance/late_replies.h"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <stdexcept>

namespace axlecast {
namespace {

constexpr MonoNs kStep = 50 * kMillisecond;  // how often the voltage, and whether replies are late, may change
constexpr double kTolerance = 2;             // counts: rounding of both, and the speed's
constexpr std::size_t kSteps = 5'000;        // of the voltage, 0.1 V each; then from the begin

}  // namespace

const char* MixName(LateMix mix) {
  switch (mix) {
    case LateMix::kAlways:
      return "always late";
    case LateMix::kHalf:
      return "late half of the time";
    case LateMix::kMixedUp:
      return "late and mixed up half of the time";
    case LateMix::kRare:
      break;
  }
  return "rarely late";
}

LateRun::LateRun(const MachineConfig& machine, const BusConfig& bus, SecretSource& secrets, LateMix mix)
    : config_(bus), mix_(mix) {
  ConfigErrors errors("late");
  simulator_ = MakeSimulator(machine, bus, errors);
  if (!simulator_) throw std::runtime_error(errors.Text());
  link_ = std::make_unique<ExampleLink>(bus, clock_, *simulator_);
  bus_ = std::make_unique<Bus>(link_->MakeBus(clock_, *this, nullptr));
  for (std::size_t i = 0; i < bus.devices.size(); ++i) {
    outputs_.push_back(std::make_unique<Judge>(*this, i));
    devices_.push_back(bus.family->make_device(bus, bus.devices[i], *outputs_.back(), secrets));
    bus_->Add(*devices_.back());
  }
  Run(kSecond);  // the file's own motions have begun
  if (bus.family->has_position) {
    // So slow that no reply within the bound is a turn late.
    const double turn_s = std::max(4.0, 4 * static_cast<double>(bus.late) / static_cast<double>(kSecond));
    SetAll("motion", "stop");
    SetAll("speed_rpm", std::to_string(60 / turn_s));
  }
  Run(10 * kSecond);
  streams_ = bus_->counters().exchanges == 0;
  Calibrate();
  judging_ = true;
}

void LateRun::SetAll(const char* key, const std::string& value) {
  for (const DeviceConfig& device : config_.devices) {
    const Result<> set = simulator_->Set(device.name, key, value, clock_.Now());
    if (!set) throw std::runtime_error(set.error().text);
  }
}

double LateRun::CountsOf(std::size_t index, MonoNs at) const {
  for (const auto& [name, value] : simulator_->State(config_.devices[index].name, at)) {
    if (name == "single_turn") return std::stod(value);
  }
  throw std::runtime_error("no single_turn");
}

void LateRun::Calibrate() {
  if (!config_.family->has_position) return;
  const double turn_s = std::max(4.0, 4 * static_cast<double>(config_.late) / static_cast<double>(kSecond));
  for (std::size_t i = 0; i < config_.devices.size(); ++i) {
    Truth truth{.at = clock_.Now(), .counts = CountsOf(i, clock_.Now())};
    truth.turn = static_cast<double>(config_.devices[i].settings->counts_per_turn);
    const double later = CountsOf(i, clock_.Now() + static_cast<MonoNs>(turn_s * 2.5e8));
    const double moved = std::remainder(later - truth.counts, truth.turn);
    truth.per_ns = std::copysign(truth.turn / (turn_s * 1e9), moved);
    truth.counts += 0.5;  // the counts are rounded down
    truth_.push_back(truth);
  }
}

void LateRun::Run(MonoNs duration) {
  for (const MonoNs end = clock_.Now() + duration; clock_.Now() < end;) bus_->RunOnce(end);
}

void LateRun::Exchange(std::int64_t count, MonoNs maximum) {
  const MonoNs end = clock_.Now() + maximum;
  for (const std::int64_t last = exchanges() + count; exchanges() < last && clock_.Now() < end;) {
    if (clock_.Now() >= next_step_) Step();
    bus_->RunOnce(next_step_);
  }
}

bool LateRun::LateNow() const {
  // A whole exchange or several: late and timely ones follow each other in every way.
  const std::uint64_t random = phase_ * 0x9E3779B97F4A7C15U >> 40U;
  switch (mix_) {
    case LateMix::kAlways:
      return true;
    case LateMix::kHalf:
    case LateMix::kMixedUp:
      return random % 2 == 0;
    case LateMix::kRare:
      break;
  }
  return random % 50 == 0;
}

void LateRun::Step() {
  next_step_ = clock_.Now() + kStep;
  ++phase_;
  if (late_ != LateNow()) {
    late_ = !late_;
    MonoNs timeout = 0;
    for (const DeviceConfig& device : config_.devices) timeout = std::max(timeout, device.settings->reply_timeout);
    // Of replies short delays too: of several periods of SYNC, for instance.
    const MonoNs part = std::int64_t{1} << 2 * (phase_ / 2 % 4);
    const MonoNs longest = streams_ ? config_.late * 2 / 5 : 10 * timeout / part;
    // CAN adapters keep the order of frames.
    const bool in_order = streams_ || config_.family->link == LinkKind::kCan;
    const std::string fault = mix_ == LateMix::kMixedUp && !in_order ? "scattered:" : "late:";
    SetAll("fault", late_ ? fault + std::to_string(static_cast<double>(longest) / kMillisecond) : "none");
  }
  if (config_.family->has_position) return;
  std::array<char, 16> volts{};
  std::snprintf(volts.data(), volts.size(), "%.1f", 100 + 0.1 * static_cast<double>(steps_.size() % kSteps));
  SetAll("voltage_v", volts.data());
  steps_.push_back(clock_.Now());
}

void LateRun::Count(MonoNs distance) {
  ++readings_;
  if (distance <= 0) return;
  ++missed_;
  worst_ = std::max(worst_, distance);
}

void LateRun::OnSample(std::size_t index, const Sample& sample) {
  if (!judging_ || sample.error) return;
  const Truth& truth = truth_[index];
  const double first = truth.counts + truth.per_ns * static_cast<double>(sample.at.first - truth.at);
  const double whole = truth.per_ns * static_cast<double>(sample.at.last - sample.at.first);
  const double way = std::remainder(static_cast<double>(sample.counts) + 0.5 - first - whole / 2, truth.turn);
  const double beyond = std::abs(way) - std::abs(whole / 2) - kTolerance;
  Count(static_cast<MonoNs>(beyond / std::abs(truth.per_ns)));
}

// The unit may latch a little before or after the change.
void LateRun::OnMotor(const MotorReading& reading) {
  // What was read before the first step is reported with the time at which it was read.
  if (!judging_ || !reading.has_analog() || steps_.empty() || reading.analog_at.last < steps_.front()) return;
  auto index = static_cast<std::size_t>(std::llround((reading.voltage_v - 100) * 10));
  // The same voltage comes again: the last time that was not after the reading.
  while (index + kSteps < steps_.size() && steps_[index + kSteps] <= reading.analog_at.last) index += kSteps;
  if (index >= steps_.size()) return;
  const MonoNs from = steps_[index];
  const MonoNs to = index + 1 < steps_.size() ? steps_[index + 1] : kNever;
  Count(std::max(reading.analog_at.first - to, from - reading.analog_at.last));
}

}  // namespace axlecast
