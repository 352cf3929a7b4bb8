#include "drivers/kit/simulation/shaft.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>

namespace axlecast {
namespace {

constexpr double kTurn = static_cast<double>(kShaftTurn);
constexpr double kTwoPi = 2 * std::numbers::pi;

double SpeedFromRpm(double rpm) { return rpm / 60 * kTurn; }
double AccelFromRadians(double rad_s2) { return rad_s2 / kTwoPi * kTurn; }
double Seconds(MonoNs duration) { return static_cast<double>(duration) * 1e-9; }
MonoNs Nanoseconds(double seconds) { return static_cast<MonoNs>(std::llround(seconds * 1e9)); }

// Wraps instead of overflowing: a wrapped angle is still right modulo 2^34 turns.
ShaftAngle Sum(ShaftAngle a, ShaftAngle b) {
  return static_cast<ShaftAngle>(static_cast<std::uint64_t>(a) + static_cast<std::uint64_t>(b));
}

// Exact for any duration: whole seconds are integers, and what is left of one fits a double.
ShaftAngle Travel(double speed, MonoNs duration) {
  const auto per_second = static_cast<std::int64_t>(std::llround(speed));
  const auto whole = static_cast<std::uint64_t>(per_second) * static_cast<std::uint64_t>(duration / kSecond);
  const double rest = static_cast<double>(per_second) * Seconds(duration % kSecond);
  return Sum(static_cast<ShaftAngle>(whole), std::llround(rest));
}

constexpr double kMaxDegrees = 1e8;
constexpr double kMaxRpm = 20'000;
constexpr double kMaxAcceleration = 200'000;  // rad/s^2
constexpr double kMaxSeconds = 1e6;

// The numbers of "NAME:1,2,3". Each has its range and its unit.
struct Operand {
  double min = 0;
  double max = 0;
  std::string_view unit;
};
constexpr Operand kAngle = {-kMaxDegrees, kMaxDegrees, "deg"};
constexpr Operand kSpeed = {0.001, kMaxRpm, "rpm"};

Result<std::vector<double>> ParseOperands(std::string_view text, std::initializer_list<Operand> operands) {
  std::vector<double> values;
  for (const Operand& operand : operands) {
    const std::size_t comma = text.find(',');
    const Result<double> value = ParseNumber(text.substr(0, comma), operand.min, operand.max, operand.unit);
    if (!value) return Failure(value.error());
    values.push_back(*value);
    text.remove_prefix(comma == std::string_view::npos ? text.size() : comma + 1);
    while (text.starts_with(' ')) text.remove_prefix(1);
  }
  return values;
}

Result<> BeginSine(Shaft& shaft, std::string_view operands, MonoNs now) {
  const auto values = ParseOperands(operands, {{0, 1e6, "deg"}, {0.001, kMaxSeconds, "s"}});
  if (!values) return Failure(values.error());
  const ShaftAngle amplitude = AngleFromDegrees(values->at(0));
  const MonoNs period = Nanoseconds(values->at(1));
  const double peak = Shaft::SwingAcceleration(amplitude, period);
  if (peak > shaft.acceleration_rad_s2()) {
    return Failure("this sine needs " + NumberText(peak) + " rad/s^2, more than accel_rad_s2 (" +
                   NumberText(shaft.acceleration_rad_s2()) +
                   "): make it slower or smaller, or set accel_rad_s2 first");
  }
  shaft.Swing(amplitude, period, now);
  return {};
}

Result<> BeginShuttle(Shaft& shaft, std::string_view operands, MonoNs now) {
  const auto values = ParseOperands(operands, {kAngle, kAngle, kSpeed});
  if (!values) return Failure(values.error());
  shaft.Shuttle(AngleFromDegrees(values->at(0)), AngleFromDegrees(values->at(1)), values->at(2), now);
  return {};
}

Result<> BeginMove(Shaft& shaft, std::string_view operands, MonoNs now) {
  const auto values = ParseOperands(operands, {kAngle, kSpeed});
  if (!values) return Failure(values.error());
  shaft.MoveTo(AngleFromDegrees(values->at(0)), values->at(1), now);
  return {};
}

Result<> BeginMotion(Shaft& shaft, std::string_view text, MonoNs now) {
  const std::size_t colon = std::min(text.find(':'), text.size());
  const std::string_view name = text.substr(0, colon);
  const std::string_view operands = text.substr(std::min(colon + 1, text.size()));
  const auto commas = std::count(operands.begin(), operands.end(), ',');
  if (name == "sine" && commas == 1) return BeginSine(shaft, operands, now);
  if (name == "shuttle" && commas == 2) return BeginShuttle(shaft, operands, now);
  if (name == "move" && commas == 1) return BeginMove(shaft, operands, now);
  return Failure("'" + std::string(text) +
                 "' is not one of stop, sine:AMPLITUDE_DEG,PERIOD_S, shuttle:FROM_DEG,TO_DEG,RPM, move:TO_DEG,RPM");
}

}  // namespace

ShaftAngle AngleFromDegrees(double degrees) { return std::llround(degrees / 360 * kTurn); }
double DegreesFromAngle(ShaftAngle angle) { return static_cast<double>(angle) / kTurn * 360; }

std::uint64_t CountsFromAngle(ShaftAngle angle, int bits) {
  const auto in_turn = static_cast<std::uint64_t>(angle & (kShaftTurn - 1));
  const int finer = bits - kTurnBits;
  return finer >= 0 ? in_turn << finer : in_turn >> -finer;
}

std::uint64_t TurnsFromAngle(ShaftAngle angle, int turn_bits) {
  return static_cast<std::uint64_t>(angle >> kTurnBits) & ((std::uint64_t{1} << turn_bits) - 1);
}

Shaft::Shaft(ShaftAngle angle) {
  end_.from = angle;
  AddRest();
}

void Shaft::SetAcceleration(double rad_s2) { accel_rad_s2_ = rad_s2; }

// ---- making a plan ----

void Shaft::Begin(MonoNs now) {
  now = std::max(now, commanded_);
  const State state = At(now);
  commanded_ = now;
  plan_.clear();
  cycle_begin_ = kNever;
  end_ = {};
  end_.from = state.angle;
  end_.speed = SpeedFromRpm(state.speed_rpm);
}

void Shaft::AddRamp(double to_speed) {
  const double change = to_speed - end_.speed;
  if (change == 0) return;
  Phase ramp = end_;
  ramp.accel = std::copysign(AccelFromRadians(accel_rad_s2_), change);
  const double seconds = change / ramp.accel;
  ramp.duration = Nanoseconds(seconds);
  if (ramp.duration > 0) plan_.push_back(ramp);
  end_.begin += ramp.duration;
  end_.from = Sum(end_.from, std::llround((end_.speed + to_speed) / 2 * seconds));
  end_.speed = to_speed;
}

void Shaft::AddMove(ShaftAngle target, double speed) {
  const auto distance = static_cast<double>(target - end_.from);
  const double accel = AccelFromRadians(accel_rad_s2_);
  const auto [lowest, highest] = std::minmax({end_.from, target});
  const std::size_t first = plan_.size();
  const double peak = std::min(speed, std::sqrt(std::abs(distance) * accel));
  if (peak == 0) return;
  AddRamp(std::copysign(peak, distance));
  Phase cruise = end_;
  cruise.duration = Nanoseconds(std::max(0.0, (std::abs(distance) - peak * peak / accel) / peak));
  if (cruise.duration > 0) plan_.push_back(cruise);
  end_.begin += cruise.duration;
  end_.from = Sum(end_.from, Travel(end_.speed, cruise.duration));
  AddRamp(0);
  end_.from = target;
  for (std::size_t i = first; i < plan_.size(); ++i) {
    plan_[i].lowest = lowest;
    plan_[i].highest = highest;
  }
}

void Shaft::AddRest() {
  end_.duration = kNever;
  plan_.push_back(end_);
}

void Shaft::Run(double rpm, MonoNs now) {
  Begin(now);
  AddRamp(SpeedFromRpm(rpm));
  AddRest();
}

void Shaft::MoveTo(ShaftAngle target, double rpm, MonoNs now) {
  Begin(now);
  AddRamp(0);
  AddMove(target, SpeedFromRpm(rpm));
  AddRest();
}

void Shaft::Shuttle(ShaftAngle from, ShaftAngle to, double rpm, MonoNs now) {
  Begin(now);
  AddRamp(0);
  AddMove(from, SpeedFromRpm(rpm));
  const MonoNs cycle = end_.begin;
  AddMove(to, SpeedFromRpm(rpm));
  AddMove(from, SpeedFromRpm(rpm));
  if (end_.begin == cycle) return AddRest();  // from and to are one angle
  cycle_begin_ = cycle;
}

void Shaft::Swing(ShaftAngle amplitude, MonoNs period, MonoNs now) {
  Begin(now);
  AddRamp(0);
  const double peak_speed = kTwoPi * static_cast<double>(amplitude) / Seconds(period);
  AddMove(end_.from - amplitude, peak_speed);
  if (amplitude == 0) return AddRest();
  Phase swing = end_;
  swing.duration = period;
  swing.swing = static_cast<double>(amplitude);
  cycle_begin_ = swing.begin;
  plan_.push_back(swing);
  end_.begin += period;
}

double Shaft::SwingAcceleration(ShaftAngle amplitude, MonoNs period) {
  const double omega = kTwoPi / Seconds(period);
  return omega * omega * static_cast<double>(amplitude) / kTurn * kTwoPi;
}

// ---- commands as text ----

Result<> Shaft::SetMotion(std::string_view text, MonoNs now) {
  if (text == "stop") {
    Run(0, now);
  } else if (Result<> begun = BeginMotion(*this, text, now); !begun) {
    return begun;
  }
  motion_ = text;
  return {};
}

Result<> Shaft::SetSpeed(std::string_view text, MonoNs now) {
  const Result<double> rpm = ParseNumber(text, -kMaxRpm, kMaxRpm, "rpm");
  if (!rpm) return Failure(rpm.error());
  Run(*rpm, now);
  motion_ = "constant";
  return {};
}

Result<> Shaft::SetAcceleration(std::string_view text) {
  const Result<double> rad_s2 = ParseNumber(text, 1, kMaxAcceleration, "rad/s^2");
  if (!rad_s2) return Failure(rad_s2.error());
  SetAcceleration(*rad_s2);
  return {};
}

// ---- the state at a given time ----

MonoNs Shaft::InPlan(MonoNs elapsed) const {
  if (elapsed < cycle_begin_) return elapsed;
  return cycle_begin_ + (elapsed - cycle_begin_) % (end_.begin - cycle_begin_);
}

const Shaft::Phase& Shaft::PhaseAt(MonoNs elapsed) const {
  const auto later = std::upper_bound(plan_.begin(), plan_.end(), elapsed,
                                      [](MonoNs at, const Phase& phase) { return at < phase.begin; });
  return later == plan_.begin() ? plan_.front() : *std::prev(later);
}

Shaft::State Shaft::InPhase(const Phase& phase, MonoNs elapsed) {
  if (phase.swing != 0) {
    const double omega = kTwoPi / Seconds(phase.duration);
    const double turned = omega * Seconds(elapsed);
    const double swing_rad = phase.swing / kTurn * kTwoPi;
    return {Sum(phase.from, std::llround(phase.swing * (1 - std::cos(turned)))),
            swing_rad * omega * std::sin(turned) / kTwoPi * 60, swing_rad * omega * omega * std::cos(turned)};
  }
  const auto within = [&phase](ShaftAngle angle) { return std::clamp(angle, phase.lowest, phase.highest); };
  if (phase.accel == 0) return {within(Sum(phase.from, Travel(phase.speed, elapsed))), phase.speed / kTurn * 60, 0};
  const double t = Seconds(elapsed);
  return {within(Sum(phase.from, std::llround((phase.speed + phase.accel * t / 2) * t))),
          (phase.speed + phase.accel * t) / kTurn * 60, phase.accel / kTurn * kTwoPi};
}

Shaft::State Shaft::At(MonoNs now) const {
  const MonoNs elapsed = InPlan(std::max<MonoNs>(0, now - commanded_));
  const Phase& phase = PhaseAt(elapsed);
  return InPhase(phase, elapsed - phase.begin);
}

void Shaft::Widen(Extent& extent, const Phase& phase, MonoNs from, MonoNs to) {
  // The extremes of angle, speed and acceleration are at the ends, at standstill, or at quarters of a swing.
  std::array<MonoNs, 7> instants = {from, to};
  std::size_t count = 2;
  if (phase.swing != 0) {
    for (int quarter = 0; quarter <= 4; ++quarter) instants[count++] = phase.duration / 4 * quarter;
  } else if (phase.accel != 0) {
    instants[count++] = Nanoseconds(-phase.speed / phase.accel);
  }
  for (std::size_t i = 0; i < count; ++i) {
    if (instants[i] < from || instants[i] > to) continue;
    const State state = InPhase(phase, instants[i]);
    extent.lowest = std::min(extent.lowest, state.angle);
    extent.highest = std::max(extent.highest, state.angle);
    extent.slowest_rpm = std::min(extent.slowest_rpm, std::abs(state.speed_rpm));
    extent.fastest_rpm = std::max(extent.fastest_rpm, std::abs(state.speed_rpm));
    extent.hardest_rad_s2 = std::max(extent.hardest_rad_s2, std::abs(state.accel_rad_s2));
  }
}

void Shaft::WidenOverPlan(Extent& extent, MonoNs from, MonoNs to) const {
  for (const Phase& phase : plan_) {
    const MonoNs end = phase.duration == kNever ? kNever : phase.begin + phase.duration;
    if (end <= from || phase.begin > to) continue;
    Widen(extent, phase, std::max(from, phase.begin) - phase.begin, std::min(to, end) - phase.begin);
  }
}

Shaft::Extent Shaft::Over(MonoNs from, MonoNs to) const {
  const State start = At(from);
  Extent extent{start.angle, start.angle, std::abs(start.speed_rpm), std::abs(start.speed_rpm),
                std::abs(start.accel_rad_s2)};
  from = std::max<MonoNs>(0, from - commanded_);
  to = std::max(from, to - commanded_);
  if (to < cycle_begin_) {
    WidenOverPlan(extent, from, to);
    return extent;
  }
  const MonoNs period = end_.begin - cycle_begin_;
  if (from < cycle_begin_) WidenOverPlan(extent, from, cycle_begin_);
  from = std::max(from, cycle_begin_);
  if (to - from >= period) {
    WidenOverPlan(extent, cycle_begin_, end_.begin);
  } else if (InPlan(from) <= InPlan(to)) {
    WidenOverPlan(extent, InPlan(from), InPlan(to));
  } else {
    WidenOverPlan(extent, InPlan(from), end_.begin);
    WidenOverPlan(extent, cycle_begin_, InPlan(to));
  }
  return extent;
}

}  // namespace axlecast
