#pragma once

#include <cstdint>
#include <vector>

#include "core/base/time.h"

namespace axlecast {

// An angle in 2^-30 turn, counter-clockwise positive seen from the shaft end. 64 bits hold 2^33 turns either way:
// 2.7 years at 6,000 rpm.
using ShaftAngle = std::int64_t;
inline constexpr int kTurnBits = 30;
inline constexpr ShaftAngle kShaftTurn = ShaftAngle{1} << kTurnBits;
[[nodiscard]] ShaftAngle AngleFromDegrees(double degrees);
[[nodiscard]] double DegreesFromAngle(ShaftAngle angle);

// A shaft that somebody turns. Its motion is a plan made when it is ordered: angle, speed and acceleration at an
// instant follow from the plan alone, so looking more or less often changes nothing and nothing drifts.
class Shaft {
 public:
  struct State {
    ShaftAngle angle = 0;
    double speed_rpm = 0;
    double accel_rad_s2 = 0;
  };
  // What happened in a stretch of time.
  struct Extent {
    ShaftAngle lowest = 0;
    ShaftAngle highest = 0;
    double slowest_rpm = 0;  // without sign
    double fastest_rpm = 0;  // without sign
    double hardest_rad_s2 = 0;
  };

  // Stands at `angle` until ordered to turn.
  explicit Shaft(ShaftAngle angle = 0);

  // The acceleration of every ramp ordered from now on, rad/s^2 above 0.
  void SetAcceleration(double rad_s2);
  [[nodiscard]] double acceleration_rad_s2() const { return accel_rad_s2_; }

  // Each order begins at `now` with the speed that the shaft has; all but Run brake to standstill first.
  void Run(double rpm, MonoNs now);
  void MoveTo(ShaftAngle target, double rpm, MonoNs now);                // a trapezoid of speed, then stands
  void Shuttle(ShaftAngle from, ShaftAngle to, double rpm, MonoNs now);  // from, to, from, ... for ever
  void Swing(ShaftAngle amplitude, MonoNs period, MonoNs now);           // a sine about the angle where it stood
  // The largest acceleration of a Swing, rad/s^2.
  [[nodiscard]] static double SwingAcceleration(ShaftAngle amplitude, MonoNs period);

  [[nodiscard]] State At(MonoNs now) const;
  [[nodiscard]] Extent Over(MonoNs from, MonoNs to) const;

 private:
  // A stretch of the plan. With a swing: angle = from + swing * (1 - cos(2 pi t / duration)); else a parabola.
  struct Phase {
    MonoNs begin = 0;  // after the order
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
  MonoNs ordered_ = 0;
  std::vector<Phase> plan_;
  MonoNs cycle_begin_ = kNever;  // the part of the plan from here on repeats
  Phase end_;                    // where the plan ends while it is being made
};

}  // namespace axlecast
