#pragma once

#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "core/base/result.h"
#include "core/base/time.h"
#include "drivers/kit/simulation/quantity.h"

namespace axlecast {

// An angle in 2^-30 turn, counter-clockwise positive seen from the shaft end. 64 bits hold 2^33 turns either way:
// 2.7 years at 6,000 rpm.
using ShaftAngle = std::int64_t;
inline constexpr int kTurnBits = 30;
inline constexpr ShaftAngle kShaftTurn = ShaftAngle{1} << kTurnBits;
[[nodiscard]] ShaftAngle AngleFromDegrees(double degrees);
[[nodiscard]] double DegreesFromAngle(ShaftAngle angle);
// Returns the position within the turn in 2^-bits turn. Bits finer than the shaft's are 0.
[[nodiscard]] std::uint64_t CountsFromAngle(ShaftAngle angle, int bits);
// Returns the number of the turn, as a counter with these bits shows it.
[[nodiscard]] std::uint64_t TurnsFromAngle(ShaftAngle angle, int turn_bits);

// A simulated shaft. Each command makes a plan of the motion. Angle, speed and acceleration at any time follow from the
// plan alone: they do not drift, and do not depend on how often the shaft is read.
class Shaft {
 public:
  struct State {
    ShaftAngle angle = 0;
    double speed_rpm = 0;
    double accel_rad_s2 = 0;
  };
  // Extremes within an interval of time.
  struct Extent {
    ShaftAngle lowest = 0;
    ShaftAngle highest = 0;
    double slowest_rpm = 0;  // without sign
    double fastest_rpm = 0;  // without sign
    double hardest_rad_s2 = 0;
  };

  // Rests at `angle` until a command turns it.
  explicit Shaft(ShaftAngle angle = 0);

  // Sets the acceleration of all later ramps, in rad/s^2 above 0.
  void SetAcceleration(double rad_s2);
  [[nodiscard]] double acceleration_rad_s2() const { return accel_rad_s2_; }

  // Each command begins at `now` with the present speed. All except Run brake to standstill first.
  void Run(double rpm, MonoNs now);
  void MoveTo(ShaftAngle target, double rpm, MonoNs now);                // a trapezoid of speed, then rest
  void Shuttle(ShaftAngle from, ShaftAngle to, double rpm, MonoNs now);  // from, to, from, ... without end
  void Swing(ShaftAngle amplitude, MonoNs period, MonoNs now);           // a sine that begins at the present angle
  // Returns the largest acceleration of a Swing, in rad/s^2.
  [[nodiscard]] static double SwingAcceleration(ShaftAngle amplitude, MonoNs period);

  // The same commands as text. SetMotion accepts "stop", "sine:AMPLITUDE_DEG,PERIOD_S", "shuttle:FROM_DEG,TO_DEG,RPM"
  // and "move:TO_DEG,RPM". Angles count over several turns (720 is two turns from 0) and ignore any zero set later.
  [[nodiscard]] Result<> SetMotion(std::string_view text, MonoNs now);
  // A speed in rpm, counter-clockwise positive.
  [[nodiscard]] Result<> SetSpeed(std::string_view text, MonoNs now);
  [[nodiscard]] Result<> SetAcceleration(std::string_view text);
  // The text of the last SetMotion; "constant" after SetSpeed and at the start.
  [[nodiscard]] const std::string& motion() const { return motion_; }

  [[nodiscard]] State At(MonoNs now) const;
  [[nodiscard]] Extent Over(MonoNs from, MonoNs to) const;

 private:
  // A section of the plan. With a swing: angle = from + swing * (1 - cos(2 pi t / duration)); else a parabola.
  struct Phase {
    MonoNs begin = 0;  // after the command
    MonoNs duration = kNever;
    ShaftAngle from = 0;
    double speed = 0;  // 2^-30 turn/s at its begin
    double accel = 0;  // 2^-30 turn/s^2
    double swing = 0;  // 2^-30 turn
    // A move never leaves the way from its start to its target; rounded parabolas alone would, by some 2^-30 turn.
    ShaftAngle lowest = INT64_MIN;
    ShaftAngle highest = INT64_MAX;
  };

  [[nodiscard]] static State InPhase(const Phase& phase, MonoNs elapsed);
  static void Widen(Extent& extent, const Phase& phase, MonoNs from, MonoNs to);
  void WidenOverPlan(Extent& extent, MonoNs from, MonoNs to) const;
  [[nodiscard]] MonoNs InPlan(MonoNs elapsed) const;  // folds the repeating part
  [[nodiscard]] const Phase& PhaseAt(MonoNs elapsed) const;

  void Begin(MonoNs now);
  void AddRamp(double to_speed);
  void AddMove(ShaftAngle target, double speed);
  void AddRest();

  double accel_rad_s2_ = 2000;
  MonoNs commanded_ = 0;  // time of the last command
  std::vector<Phase> plan_;
  MonoNs cycle_begin_ = kNever;  // the part of the plan from here on repeats
  Phase end_;                    // end of the plan while it is being made
  std::string motion_ = "constant";
};

// The quantities `accel_rad_s2`, `motion` and `speed_rpm`. `shaft` returns a reference to the shaft of a device, and
// `now` the device's time. Both are pointers to members or generic lambdas, as for NumberQuantity (quantity.h).
template <typename Device, typename ShaftOf>
[[nodiscard]] SimulatedQuantity<Device> AccelerationQuantity(ShaftOf shaft) {
  return {"accel_rad_s2",
          [=](Device& device, std::string_view value) { return std::invoke(shaft, device).SetAcceleration(value); },
          [=](const Device& device) { return NumberText(std::invoke(shaft, device).acceleration_rad_s2()); }};
}
template <typename Device, typename ShaftOf, typename NowOf>
[[nodiscard]] SimulatedQuantity<Device> MotionQuantity(ShaftOf shaft, NowOf now) {
  return {"motion",
          [=](Device& device, std::string_view value) {
            return std::invoke(shaft, device).SetMotion(value, std::invoke(now, device));
          },
          [=](const Device& device) { return std::invoke(shaft, device).motion(); }};
}
template <typename Device, typename ShaftOf, typename NowOf>
[[nodiscard]] SimulatedQuantity<Device> SpeedQuantity(ShaftOf shaft, NowOf now) {
  return {"speed_rpm",
          [=](Device& device, std::string_view value) {
            return std::invoke(shaft, device).SetSpeed(value, std::invoke(now, device));
          },
          [=](const Device& device) {
            return NumberText(std::invoke(shaft, device).At(std::invoke(now, device)).speed_rpm);
          }};
}

}  // namespace axlecast
