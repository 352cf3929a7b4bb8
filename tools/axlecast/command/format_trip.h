#pragma once

#include <axlecast/trip_log_t.hpp>
#include <cstddef>
#include <string>
#include <string_view>
#include <vector>

#include "core/base/result.h"

namespace axlecast {

// The seven curves of a trip log, in the order of trip_log_t.samples.
struct TripQuantity {
  std::string_view name;
  std::string_view unit;
  int decimals;
};
inline constexpr TripQuantity kTripQuantities[] = {
    {"voltage", "V", 1},           {"current", "A", 3},           {"power", "W", 1},
    {"temperature", "degC", 1},    {"acceleration x", "m/s2", 2}, {"acceleration y", "m/s2", 2},
    {"acceleration z", "m/s2", 2},
};
inline constexpr std::size_t kTripSamples = 20;

// Returns NaN if the sample was not read.
[[nodiscard]] double TripSample(const trip_log_t& trip, std::size_t quantity, std::size_t sample);
// Returns the time relative to the trip in s, at most 0. If the interval is unknown, the unit is samples.
[[nodiscard]] double TripTime(const trip_log_t& trip, std::size_t sample);
// "trip 5, power upper A"
[[nodiscard]] std::string TripTitle(const trip_log_t& trip);

// Formats the trips in the given order, newest first, each with its samples.
[[nodiscard]] std::string TripTable(const std::string& device, const std::vector<trip_log_t>& trips);

// Draws the seven curves of the trips, newest first, as one SVG picture: a panel for each quantity over the time before the
// trip. A circle marks the sample of the trip. Fails if memory is short.
[[nodiscard]] Result<std::string> TripSvg(const std::string& device, const std::vector<trip_log_t>& trips);

}  // namespace axlecast
