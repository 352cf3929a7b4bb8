#pragma once

#include <axlecast/trip_log_t.hpp>
#include <cstdint>
#include <nlohmann/json_fwd.hpp>
#include <optional>
#include <string>

#include "platform/db/database.h"
#include "tools/web/fleet_request.h"

namespace axlecast {

// Returns the trip that `json`, the message of a row of axlecast.trip, describes; nothing if it is not one.
[[nodiscard]] std::optional<trip_log_t> TripOf(const nlohmann::ordered_json& json);

// Returns `fleet_trips`, whose trips are as the frame `trip`. `rows`: messages.
[[nodiscard]] std::string TripsFrame(const FleetRequest& request, const db::Rows& rows, std::int64_t max_rows,
                                     std::int64_t utime);

}  // namespace axlecast
