#pragma once

#include <axlecast/trip_log_t.hpp>
#include <string>
#include <vector>

#include "core/base/result.h"

namespace axlecast {

// Formats the trips in the given order, newest first, each with its samples.
[[nodiscard]] std::string TripTable(const std::string& device, const std::vector<trip_log_t>& trips);

// Draws the seven curves of the trips, newest first, as one SVG picture: a panel for each quantity over the time before the
// trip. A circle marks the sample of the trip. Fails if memory is short.
[[nodiscard]] Result<std::string> TripSvg(const std::string& device, const std::vector<trip_log_t>& trips);

}  // namespace axlecast
