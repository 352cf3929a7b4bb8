#include "bridge/state/shaft_travel.h"

#include <algorithm>
#include <cmath>
#include <cstdlib>

#include "core/device/operation.h"

namespace axlecast {
namespace {

// Two readings at rest differ by the noise of each, and by a thousandth of a turn of play and drift.
std::int64_t RestingCounts(const DeviceSettings& settings) {
  return std::max(2 * settings.noise_counts, settings.counts_per_turn / 1'000);
}

// The shortest way, where whole windows cannot be told apart.
std::int64_t Wrapped(std::int64_t way, std::int64_t window) {
  const std::int64_t within = ((way % window) + window) % window;
  return within > window / 2 ? within - window : within;
}

}  // namespace

ShaftTravel Travelled(const DeviceConfig& device, std::int64_t before, std::int64_t after) {
  const DeviceSettings& settings = *device.settings;
  const bool single_turn = settings.turns_range <= 1;
  const std::int64_t window = settings.counts_per_turn * std::max<std::int64_t>(settings.turns_range, 1);
  ShaftTravel travel;
  travel.counts = Wrapped(after - before, window);
  travel.turns = static_cast<double>(travel.counts) / static_cast<double>(settings.counts_per_turn);
  const std::int64_t way = std::abs(travel.counts);
  if (way <= RestingCounts(settings)) {
    travel.verdict = ShaftTravel::Verdict::kResting;
  } else if (single_turn) {
    travel.verdict = ShaftTravel::Verdict::kTurnsUnknown;
  } else {
    travel.verdict = way <= window / 4 ? ShaftTravel::Verdict::kWithinWindow : ShaftTravel::Verdict::kBeyondWindow;
  }
  return travel;
}

std::string TravelText(const ShaftTravel& travel, const DeviceConfig& device, std::int64_t away_us) {
  const double away_s = static_cast<double>(away_us) / 1e6;
  const auto range = static_cast<long long>(device.settings->turns_range);
  switch (travel.verdict) {
    case ShaftTravel::Verdict::kResting:
      return Text("did not move in the %.1f s without its driver", away_s);
    case ShaftTravel::Verdict::kWithinWindow:
      return Text("moved by %.4f turns in the %.1f s without its driver; the encoder tells %lld turns apart",
                  travel.turns, away_s, range);
    case ShaftTravel::Verdict::kBeyondWindow:
      return Text(
          "moved by %.4f turns or further in the %.1f s without its driver: more than a quarter of the %lld "
          "turns that the encoder tells apart; check its place",
          travel.turns, away_s, range);
    case ShaftTravel::Verdict::kTurnsUnknown:
      return Text(
          "its angle changed by %.4f turns in the %.1f s without its driver, besides any number of whole "
          "turns: a single-turn encoder cannot tell them; check its place",
          travel.turns, away_s);
  }
  return "";
}

}  // namespace axlecast
