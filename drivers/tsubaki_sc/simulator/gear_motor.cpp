#include "drivers/tsubaki_sc/simulator/gear_motor.h"

#include <cmath>

#include "drivers/kit/simulation/quantity.h"

namespace axlecast::tsubaki_sc::simulator {
namespace {

constexpr double kMaxSeconds = 1e6;
constexpr double kMaxWatts = 10'000;
constexpr std::string_view kNone = "none";

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

}  // namespace axlecast::tsubaki_sc::simulator
