#pragma once

#include <algorithm>
#include <array>
#include <cstdint>
#include <numbers>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "core/base/result.h"
#include "core/base/time.h"
#include "drivers/kit/simulation/simulated_fault.h"

namespace axlecast::tsubaki_sc::simulator {

// The power that a machine requires of its motor over time: points joined by straight lines, repeated.
class LoadProfile {
 public:
  // Parses "S:W,S:W,...": seconds, rising from 0, and watts of electric power. "none": no profile.
  [[nodiscard]] static Result<LoadProfile> Parse(std::string_view text);

  [[nodiscard]] bool empty() const { return points_.empty(); }
  // Returns watts, `seconds` >= 0 after its begin. Precondition: not empty.
  [[nodiscard]] double At(double seconds) const;
  [[nodiscard]] std::string Text() const;

 private:
  struct Point {
    double seconds = 0;
    double watts = 0;
  };
  std::vector<Point> points_;
};

// A three-phase gear motor and what it drives. Time advances in steps of kStep.
class GearMotor {
 public:
  static constexpr MonoNs kStep = 10 * kMillisecond;
  static constexpr MonoNs kShockLasts = 30 * kMillisecond;

  struct Settings {
    double torque_nm = 50;   // required of the output shaft
    double speed_rpm = 30;   // of the output shaft while it runs
    double voltage_v = 200;  // between phases
    double power_factor = 0.8;
    double run_up_w = 600;  // drawn while it runs up, if more than the load
    double run_up_s = 0.5;
    double ambient_c = 25;
    double heating_c_per_w = 0.15;  // above ambient in the end
    double thermal_s = 0;           // time constant; 0: the temperature stays as it was set
    std::array<double, 3> accel_mps2{};
    double vibration_mps2 = 0;  // while it runs, either way on each axis
  };
  struct Reading {
    double voltage_v = 0;
    double current_a = 0;
    double power_w = 0;
    double temperature_c = 0;
    std::array<double, 3> accel_mps2{};
  };

  Settings settings;

  explicit GearMotor(std::uint64_t seed) : random_(seed) {}

  void Start(MonoNs now) {
    if (running_) return;
    running_ = true;
    started_at_ = now;
  }
  void Stop() { running_ = false; }
  [[nodiscard]] bool running() const { return running_; }

  // Sets the torque from the electric power in W at nominal speed.
  void SetLoad(double watts) {
    profile_ = {};
    settings.torque_nm = watts / WattsPerNm();
  }
  [[nodiscard]] double load_w(MonoNs now) const {
    if (!profile_.empty()) return profile_.At(Seconds(std::max<MonoNs>(0, now - profile_begin_)));
    return settings.torque_nm * WattsPerNm();
  }
  void SetProfile(LoadProfile profile, MonoNs now) {
    profile_ = std::move(profile);
    profile_begin_ = now;
  }
  [[nodiscard]] const LoadProfile& profile() const { return profile_; }
  void SetTemperature(double celsius) { temperature_c_ = celsius; }
  // Starts a shock on axis 0, 1 or 2 that lasts kShockLasts.
  void Shock(std::size_t axis, double mps2, MonoNs now) {
    shock_axis_ = axis;
    shock_mps2_ = mps2;
    shock_until_ = now + kShockLasts;
  }

  // Advances by kStep to `now`.
  void Step(MonoNs now) {
    if (settings.thermal_s > 0) {
      const double end_c = settings.ambient_c + settings.heating_c_per_w * PowerAt(now);
      temperature_c_ += (end_c - temperature_c_) * std::min(1.0, Seconds(kStep) / settings.thermal_s);
    }
    if (settings.vibration_mps2 == 0) return;
    for (double& axis : vibration_) axis = settings.vibration_mps2 * (2 * random_.Share() - 1);
  }
  [[nodiscard]] Reading At(MonoNs now) const {
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
  [[nodiscard]] double SpeedAt(MonoNs now) const {
    if (!running_ || settings.voltage_v == 0) return 0;
    const double since = Seconds(now - started_at_);
    return since < settings.run_up_s ? settings.speed_rpm * since / settings.run_up_s : settings.speed_rpm;
  }

 private:
  [[nodiscard]] static double Seconds(MonoNs duration) { return static_cast<double>(duration) * 1e-9; }
  // Returns the electric power for 1 Nm on the output shaft.
  [[nodiscard]] double WattsPerNm() const {
    constexpr double kEfficiency = 0.8;  // of motor and gear
    return settings.speed_rpm / 60 * 2 * std::numbers::pi / kEfficiency;
  }
  [[nodiscard]] double PowerAt(MonoNs now) const {
    if (!running_ || settings.voltage_v == 0) return 0;
    const bool runs_up = Seconds(now - started_at_) < settings.run_up_s;
    return runs_up ? std::max(settings.run_up_w, load_w(now)) : load_w(now);
  }

  bool running_ = false;
  MonoNs started_at_ = 0;
  LoadProfile profile_;
  MonoNs profile_begin_ = 0;
  double temperature_c_ = 40;
  std::size_t shock_axis_ = 0;
  double shock_mps2_ = 0;
  MonoNs shock_until_ = 0;
  std::array<double, 3> vibration_{};  // of the present step
  SeededRandom random_;
};

}  // namespace axlecast::tsubaki_sc::simulator
