#pragma once

#include <axlecast/trip_log_t.hpp>
#include <string>
#include <vector>

namespace axlecast {

// The seven curves of the trips, newest first, as one SVG picture: a panel for each quantity over the time before the
// trip, all trips in it; the sample of the trip is marked. Readable on light and dark ground.
[[nodiscard]] std::string TripSvg(const std::string& device, const std::vector<trip_log_t>& trips);

}  // namespace axlecast
