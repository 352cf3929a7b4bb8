#include "tests/time_guests/shaft_looks.h"

#include <algorithm>
#include <cmath>
#include <fstream>
#include <sstream>

namespace axlecast {
namespace {

// The simulator states angles with 12 digits: below 10^7 deg, 5 x 10^-6 deg, which are some 0.3 ns at 3,000 rpm.
constexpr std::int64_t kRounding = 2;  // ns

double TurnsPerNs(const ShaftLook& look) { return look.speed_rpm / 60e9; }

// Returns the instant at which the shaft has turned so far.
double InstantOf(const ShaftLook& look, double turns) {
  return static_cast<double>(look.mono) + (turns - look.turns) / TurnsPerNs(look);
}

}  // namespace

std::optional<Bounds> ShaftLooks::When(std::int64_t counts, std::int64_t counts_per_turn) const {
  if (looks_.size() < 2) return std::nullopt;
  const ShaftLook& first = looks_.front();
  if (first.speed_rpm == 0) return std::nullopt;
  const bool constant = std::all_of(looks_.begin(), looks_.end(), [&](const ShaftLook& look) {
    return look.speed_rpm == first.speed_rpm &&
           std::abs(InstantOf(first, look.turns) - static_cast<double>(look.mono)) <= kRounding;
  });
  if (!constant) return std::nullopt;
  const auto at = [&](std::int64_t count) {
    return InstantOf(first, static_cast<double>(count) / static_cast<double>(counts_per_turn));
  };
  const auto [begin, end] = std::minmax({at(counts), at(counts + 1)});
  const Bounds bounds = {static_cast<std::int64_t>(std::floor(begin)) - kRounding,
                         static_cast<std::int64_t>(std::ceil(end)) + kRounding};
  if (bounds.lowest < first.mono || bounds.highest > looks_.back().mono) return std::nullopt;
  return bounds;
}

Result<std::map<std::string, ShaftLooks>> ReadShaftLooks(const std::filesystem::path& path) {
  std::map<std::string, ShaftLooks> shafts;
  std::ifstream file(path);
  for (std::string line; std::getline(file, line);) {
    std::istringstream words(line);
    std::string device;
    ShaftLook look;
    double degrees = 0;
    if (!(words >> device >> look.mono >> degrees >> look.speed_rpm)) {
      return Failure("not a look at a shaft in " + path.string() + ": " + line);
    }
    look.turns = degrees / 360;
    shafts[device].Add(look);
  }
  return shafts;
}

}  // namespace axlecast
