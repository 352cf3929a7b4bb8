#include "tools/web/fleet/fleet_trip.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <nlohmann/json.hpp>

#include "core/messages/json/field.h"
#include "tools/web/web_frames.h"

namespace axlecast {
namespace {

using Json = nlohmann::ordered_json;

// Reads the integer at `key`, if it fits.
template <typename T>
bool Read(const Json& json, const char* key, T& value) {
  const auto found = json.find(key);
  if (found == json.end() || !found->is_number_integer()) return false;
  const auto number = found->get<std::int64_t>();
  value = static_cast<T>(number);
  return value == number;
}

// A number that is not finite is null in JSON.
bool ReadSamples(const Json& json, float (&samples)[20]) {
  if (!json.is_array() || json.size() != std::size(samples)) return false;
  for (std::size_t i = 0; i < std::size(samples); ++i) {
    if (!json[i].is_number() && !json[i].is_null()) return false;
    samples[i] = json[i].is_null() ? std::numeric_limits<float>::quiet_NaN() : json[i].get<float>();
  }
  return true;
}

}  // namespace

std::optional<trip_log_t> TripOf(const Json& json) {
  trip_log_t trip{};
  if (!json.is_object()) return std::nullopt;
  const auto device = json.find("device");
  if (device == json.end() || !device->is_string()) return std::nullopt;
  trip.device = device->get<std::string>();
  if (!Read(json, "utime", trip.utime) || !Read(json, "log_index", trip.log_index) ||
      !Read(json, "trip_count", trip.trip_count) || !Read(json, "factor_bits", trip.factor_bits) ||
      !Read(json, "not_before_utime", trip.not_before_utime) ||
      !Read(json, "not_after_utime", trip.not_after_utime) || !Read(json, "interval_us", trip.interval_us) ||
      !Read(json, "valid_mask", trip.valid_mask)) {
    return std::nullopt;
  }
  const auto samples = json.find("samples");
  if (samples == json.end() || !samples->is_array() || samples->size() != std::size(trip.samples))
    return std::nullopt;
  for (std::size_t i = 0; i < std::size(trip.samples); ++i) {
    if (!ReadSamples((*samples)[i], trip.samples[i])) return std::nullopt;
  }
  return trip;
}

std::string TripsFrame(const FleetRequest& request, const db::Rows& rows, std::int64_t max_rows,
                       std::int64_t utime) {
  const auto count = static_cast<int>(std::min<std::int64_t>(rows.size(), max_rows));
  std::string text =
      JsonLine({{"type", "fleet_trips"}, {"id", request.id}, {"utime", utime}, {"more", rows.size() > count}});
  text.back() = ',';  // its closing brace
  text += "\"trips\":[";
  bool first = true;
  for (int row = 0; row < count; ++row) {
    const std::optional<trip_log_t> trip = TripOf(ParseOutsideJson(rows.Text(row, 0)));
    if (!trip) continue;
    if (!first) text += ',';
    first = false;
    text += TripFrame(*trip);
  }
  return text + "]}";
}

}  // namespace axlecast
