#include "tests/simulation/shaft_truth.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <stdexcept>
#include <string_view>

#include "core/base/text.h"

namespace axlecast::simulation {
namespace {

using P = position_t;

constexpr double kRounding = 3;  // counts
constexpr double kSeen = 20;     // counts that the shaft turns until its direction is looked at
// Counters of a simulator that increase when its zero changes.
constexpr std::array<std::string_view, 6> kChanges = {"zeroings",    "presets", "writes",
                                                      "turn_resets", "changes", "saves"};

}  // namespace

void ShaftTruth::Calibrate(MonoNs now) {
  const auto turn = static_cast<double>(device_.settings->counts_per_turn);
  const auto read = [this](MonoNs at, std::string_view wanted) {
    for (const auto& [name, value] : simulator_.State(device_.name, at)) {
      if (name == wanted) return std::stod(value);
    }
    throw std::logic_error("the simulator has no " + std::string(wanted));
  };
  at_ = now;
  counts_ = read(now, "single_turn") + 0.5;  // the counts are rounded down
  total_ = read(now, "angle_deg") / 360 * turn;
  per_ns_ = read(now, "speed_rpm") / 60e9 * turn;
  // An encoder may count against its shaft.
  const MonoNs ahead = per_ns_ == 0 ? 0 : static_cast<MonoNs>(kSeen / std::abs(per_ns_));
  const double moved = std::remainder(read(now + ahead, "single_turn") + 0.5 - counts_, turn);
  if (moved * per_ns_ < 0) {
    per_ns_ = -per_ns_;
    total_ = -total_;
  }
  changes_ = Changes(now);
  known_ = true;
  settled_ = std::max(settled_, now);
}

std::string ShaftTruth::Changes(MonoNs now) const {
  std::string changes;
  for (const auto& [name, value] : simulator_.State(device_.name, now)) {
    if (std::find(kChanges.begin(), kChanges.end(), name) != kChanges.end()) changes += name + value + ' ';
  }
  return changes;
}

ShaftTruth::Verdict ShaftTruth::Judge(const position_t& position, MonoNs now) {
  if (now < settled_) return Verdict::kNotJudged;
  if (!known_) Calibrate(now);
  const MonoNs first = position.mono_ns - position.time_uncertainty_ns;
  // A resolution that the device itself states as reduced is another bound.
  if (first < settled_ || (position.flags & P::FLAG_LOW_ACCURACY) != 0) return Verdict::kNotJudged;
  const double tolerance = kRounding + std::abs(per_ns_) * position.time_uncertainty_ns;
  if (TurnIsTrue(position, tolerance) && CountsAreTrue(position, tolerance)) return Verdict::kTrue;
  // A command may have changed the zero between the last reading and this one.
  const bool changed = changes_ != Changes(now);
  if (!changed) return Verdict::kFalse;
  reference_.reset();
  Calibrate(now);
  return Verdict::kNotJudged;
}

bool ShaftTruth::TurnIsTrue(const position_t& position, double tolerance) {
  const auto turn = static_cast<double>(device_.settings->counts_per_turn);
  const double expected = counts_ + per_ns_ * static_cast<double>(position.mono_ns - at_);
  const double off = std::remainder(static_cast<double>(position.raw_counts) + 0.5 - expected, turn);
  if (std::abs(off) <= tolerance) return true;
  reason_ = Text("raw_counts %lld are %.1f counts from the truth, +-%.1f are stated",
                 static_cast<long long>(position.raw_counts), off, tolerance);
  return false;
}

// The driver has followed the shaft over all turns.
bool ShaftTruth::CountsAreTrue(const position_t& position, double tolerance) {
  if ((position.flags & P::FLAG_TURNS_VALID) == 0 || (position.flags & P::FLAG_TURNS_WRAPPED) != 0) {
    reference_.reset();
    return true;
  }
  const double truth = TotalAt(position.mono_ns);
  if (!reference_ || reference_->boot_id != position.boot_id || reference_->datum_epoch != position.datum_epoch) {
    reference_ = {position.boot_id, position.datum_epoch, position.counts, truth, tolerance};
    return true;
  }
  const double off =
      std::abs(static_cast<double>(position.counts - reference_->counts)) - std::abs(truth - reference_->truth);
  if (std::abs(off) <= reference_->tolerance + tolerance + kRounding) return true;
  reason_ = Text("counts %lld are %.1f counts from the truth since the first reading",
                 static_cast<long long>(position.counts), off);
  return false;
}

}  // namespace axlecast::simulation
