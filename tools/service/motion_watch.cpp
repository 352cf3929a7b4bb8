#include "tools/service/motion_watch.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <numbers>

namespace axlecast {
namespace {

constexpr double kStretch = 0.02;  // s
constexpr double kGap = 1;         // s without a valid position, after which the motion is watched anew
// Less is a shaft that stands, and says nothing about the axis.
constexpr double kMinMotionRpm = 10;
// A limit of which more than this share was reached leaves too little margin.
constexpr double kNear = 0.8;

template <typename... Values>
std::string Print(const char* format, Values... values) {
  std::array<char, 200> text{};
  static_cast<void>(std::snprintf(text.data(), text.size(), format, values...));
  return text.data();
}

double Rpm(double rad_s) { return rad_s * 60 / (2 * std::numbers::pi); }

}  // namespace

double ProposedLimit(double seen, double margin, double maximum) {
  const double wanted = std::max(seen * margin, 1.0);
  const double digit = std::pow(10, std::floor(std::log10(wanted)) - 1);
  const double limit = std::ceil(wanted / digit - 1e-9) * digit;
  return maximum > 0 ? std::min(limit, maximum) : limit;
}

void MotionWatch::On(const position_t& position) {
  if (begin_ && (begin_->boot_id != position.boot_id || begin_->datum_epoch != position.datum_epoch))
    begin_.reset();
  if (!begin_) {
    begin_ = position;
    before_.reset();
    return;
  }
  const double seconds = static_cast<double>(position.mono_ns - begin_->mono_ns) * 1e-9;
  if (seconds < kStretch) return;
  if (seconds > kGap) {
    begin_ = position;
    before_.reset();
    return;
  }
  const double turns =
      static_cast<double>(position.counts - begin_->counts) / static_cast<double>(position.counts_per_turn);
  const Stretch now{seconds, turns * 2 * std::numbers::pi / seconds};
  speed_rpm_ = std::max(speed_rpm_, Rpm(std::abs(now.rad_s)));
  if (before_) {
    const double middles = (before_->seconds + now.seconds) / 2;
    accel_rad_s2_ = std::max(accel_rad_s2_, std::abs(now.rad_s - before_->rad_s) / middles);
  }
  before_ = now;
  begin_ = position;
}

FindingGroup MotionWatch::Judge(const DeviceConfig& device) const {
  FindingGroup group{"Motion", {}};
  group.findings.push_back(
      {"fastest seen", Print("%.4g rpm, %.4g rad/s2", speed_rpm_, accel_rad_s2_), Verdict::kUnjudged, ""});
  const bool own = device.speed_rpm > 0 && device.accel_rad_s2 > 0;
  const double most_rpm = device.settings ? device.settings->max_speed_rpm : 0;
  const double most_accel = device.settings ? device.settings->max_accel_rad_s2 : 0;
  AcceptanceResult limits{own ? "limits of the axis" : "limits of the model only", "", Verdict::kGood, ""};
  const double rpm = device.speed_rpm > 0 ? device.speed_rpm : most_rpm;
  const double accel = device.accel_rad_s2 > 0 ? device.accel_rad_s2 : most_accel;
  limits.value = Print("%.6g rpm, ", rpm) + (accel > 0 ? Print("%.6g rad/s2", accel) : "no acceleration");
  const std::string proposal =
      Print("limits: {speed_rpm: %.10g, accel_rad_s2: %.10g}", ProposedLimit(speed_rpm_, kSpeedMargin, most_rpm),
            ProposedLimit(accel_rad_s2_, kAccelMargin, most_accel));
  if (own && (speed_rpm_ > kNear * rpm || accel_rad_s2_ > kNear * accel)) {
    limits.verdict = Verdict::kAttention;
    limits.advice = "the axis comes near them; good readings beyond them are not published as valid: " + proposal;
  } else if (!own && speed_rpm_ < kMinMotionRpm) {
    limits.verdict = Verdict::kUnjudged;
    limits.advice =
        "run it again while the axis makes its fastest motions, an emergency stop among them: it then proposes "
        "limits";
  } else if (!own) {
    limits.verdict = Verdict::kUnjudged;
    limits.advice =
        proposal + Print(
                       " in the machine's file (%g and %g times what was seen) recognises far more damaged "
                       "readings, if no motion is faster than the ones seen",
                       kSpeedMargin, kAccelMargin);
  }
  group.findings.push_back(std::move(limits));
  return group;
}

}  // namespace axlecast
