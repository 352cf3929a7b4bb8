#include "drivers/tsubaki_sc/simulator/gear_motor.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <utility>

#include "drivers/kit/simulation/quantity.h"

namespace axlecast::tsubaki_sc::simulator {
namespace {

constexpr double kMaxSeconds = 1e6;
constexpr double kMaxWatts = 10'000;
constexpr std::string_view kNone = "none";

constexpr double kEfficiency = 0.8;  // of motor and gear

double Seconds(MonoNs duration) { return static_cast<double>(duration) * 1e-9; }

// Returns the electric power in W for 1 Nm on the output shaft.
double WattsPerNm(double rpm) { return rpm / 60 * 2 * std::numbers::pi / kEfficiency; }

}  // namespace

Result<LoadProfile> LoadProfile::Parse(std::string_view text) {
  LoadProfile profile;
  const std::string whole = "'" + std::string(text) + "'";
  if (text == kNone) text = {};
  while (!text.empty()) {
    const std::string_view part = text.substr(0, text.find(','));
    text.remove_prefix(std::min(text.size(), part.size() + 1));
    const std::size_t colon = part.find(':');
    if (colon == std::string_view::npos) {
      return Failure(whole + " is not S:W,S:W,... or none, e.g. 0:150,5:400,9:150");
    }
    const Result<double> seconds = ParseNumber(part.substr(0, colon), 0, kMaxSeconds, "s");
    if (!seconds) return Failure(seconds.error());
    const Result<double> watts = ParseNumber(part.substr(colon + 1), 0, kMaxWatts, "W");
    if (!watts) return Failure(watts.error());
    const bool rises = profile.empty() ? *seconds == 0 : *seconds > profile.points_.back().seconds;
    if (!rises) return Failure(whole + ": the seconds must begin with 0 and rise");
    profile.points_.push_back({*seconds, *watts});
  }
  return profile;
}

double LoadProfile::At(double seconds) const {
  const double period = points_.back().seconds;
  if (period > 0) seconds = std::fmod(seconds, period);
  const auto next = std::upper_bound(points_.begin(), points_.end(), seconds,
                                     [](double at, const Point& point) { return at < point.seconds; });
  if (next == points_.end()) return points_.back().watts;
  const Point& from = *std::prev(next);
  return from.watts + (next->watts - from.watts) * (seconds - from.seconds) / (next->seconds - from.seconds);
}

std::string LoadProfile::Text() const {
  std::string text;
  for (const Point& point : points_) {
    text += (text.empty() ? "" : ",") + NumberText(point.seconds) + ':' + NumberText(point.watts);
  }
  return text.empty() ? std::string(kNone) : text;
}

void GearMotor::Start(MonoNs now) {
  if (running_) return;
  running_ = true;
  started_at_ = now;
}

void GearMotor::SetLoad(double watts) {
  profile_ = {};
  settings.torque_nm = watts / WattsPerNm(settings.speed_rpm);
}

void GearMotor::SetProfile(LoadProfile profile, MonoNs now) {
  profile_ = std::move(profile);
  profile_begin_ = now;
}

void GearMotor::Shock(std::size_t axis, double mps2, MonoNs now) {
  shock_axis_ = axis;
  shock_mps2_ = mps2;
  shock_until_ = now + kShockLasts;
}

double GearMotor::load_w(MonoNs now) const {
  if (!profile_.empty()) return profile_.At(Seconds(std::max<MonoNs>(0, now - profile_begin_)));
  return settings.torque_nm * WattsPerNm(settings.speed_rpm);
}

double GearMotor::PowerAt(MonoNs now) const {
  if (!running_ || settings.voltage_v == 0) return 0;
  const bool runs_up = Seconds(now - started_at_) < settings.run_up_s;
  return runs_up ? std::max(settings.run_up_w, load_w(now)) : load_w(now);
}

double GearMotor::SpeedAt(MonoNs now) const {
  if (!running_ || settings.voltage_v == 0) return 0;
  const double since = Seconds(now - started_at_);
  return since < settings.run_up_s ? settings.speed_rpm * since / settings.run_up_s : settings.speed_rpm;
}

void GearMotor::Step(MonoNs now) {
  if (settings.thermal_s > 0) {
    const double end_c = settings.ambient_c + settings.heating_c_per_w * PowerAt(now);
    temperature_c_ += (end_c - temperature_c_) * std::min(1.0, Seconds(kStep) / settings.thermal_s);
  }
  if (settings.vibration_mps2 == 0) return;
  for (double& axis : vibration_) axis = settings.vibration_mps2 * (2 * random_.Share() - 1);
}

GearMotor::Reading GearMotor::At(MonoNs now) const {
  Reading reading;
  reading.voltage_v = settings.voltage_v;
  reading.power_w = PowerAt(now);
  reading.temperature_c = temperature_c_;
  if (reading.power_w > 0) {
    reading.current_a = reading.power_w / (std::numbers::sqrt3 * settings.voltage_v * settings.power_factor);
  }
  reading.accel_mps2 = settings.accel_mps2;
  for (std::size_t axis = 0; axis < 3; ++axis) {
    if (running_ && settings.vibration_mps2 > 0) reading.accel_mps2[axis] += vibration_[axis];
  }
  if (now < shock_until_) reading.accel_mps2[shock_axis_] += shock_mps2_;
  return reading;
}

}  // namespace axlecast::tsubaki_sc::simulator
