#include "tools/web/fleet_request.h"

#include <algorithm>
#include <array>
#include <utility>

namespace axlecast {
namespace {

using Json = nlohmann::ordered_json;
using Kind = FleetRequest::Kind;

constexpr std::array<std::pair<std::string_view, Kind>, 6> kTypes = {{{"fleet_machines", Kind::kMachines},
                                                                      {"fleet_devices", Kind::kDevices},
                                                                      {"fleet_alarms", Kind::kAlarms},
                                                                      {"fleet_commands", Kind::kCommands},
                                                                      {"fleet_trips", Kind::kTrips},
                                                                      {"fleet_curve", Kind::kCurve}}};

// As the columns of `hello` are named. The speed of a shaft is not stored.
constexpr std::array<CurveColumn, 9> kColumns = {{{"value", ""},
                                                  {"turns", "turn"},
                                                  {"voltage_v", "V", true},
                                                  {"current_a", "A", true},
                                                  {"power_w", "W", true},
                                                  {"temperature_c", "°C", true},
                                                  {"accel_x_mps2", "m/s²", true},
                                                  {"accel_y_mps2", "m/s²", true},
                                                  {"accel_z_mps2", "m/s²", true}}};

auto Find(std::string_view type) {
  return std::find_if(kTypes.begin(), kTypes.end(), [type](const auto& entry) { return entry.first == type; });
}

// Reads the whole number at `key`. Returns false if it is missing or out of range.
bool ReadInteger(const Json& json, const char* key, std::int64_t max, std::int64_t& value) {
  const auto found = json.find(key);
  if (found == json.end() || !found->is_number_integer()) return false;
  if (found->is_number_unsigned() && found->get<std::uint64_t>() > static_cast<std::uint64_t>(max)) return false;
  value = found->get<std::int64_t>();
  return value >= 0 && value <= max;
}

bool ReadName(const Json& json, const char* key, std::string& value) {
  const auto found = json.find(key);
  if (found == json.end() || !found->is_string()) return false;
  value = found->get<std::string>();
  return !value.empty() && value.size() <= kMaxFleetName && value.find('\0') == std::string::npos;
}

}  // namespace

const CurveColumn* FindCurveColumn(std::string_view name) {
  const auto* const found = std::find_if(kColumns.begin(), kColumns.end(),
                                         [name](const CurveColumn& column) { return column.name == name; });
  return found == kColumns.end() ? nullptr : found;
}

bool IsFleetType(std::string_view type) { return Find(type) != kTypes.end(); }

Result<FleetRequest> ParseFleetRequest(const Json& json) {
  const auto& type = json.at("type").get_ref<const std::string&>();
  const auto known = Find(type);
  if (known == kTypes.end()) return Failure("unknown question to the fleet");
  const auto wrong = [&type](const char* text) { return Failure(type + ": " + text); };
  FleetRequest request = {.kind = known->second};
  if (!ReadInteger(json, "id", kMaxFleetId, request.id))
    return wrong("id is not a whole number from 0 to 2^53 - 1");
  if (request.kind == Kind::kMachines) return request;
  if (!ReadName(json, "machine", request.machine)) return wrong("machine is not a name of 1 to 128 bytes");
  if (request.kind == Kind::kDevices) return request;
  if (!ReadInteger(json, "from_utime", kLatestFleetUtime, request.from) ||
      !ReadInteger(json, "to_utime", kLatestFleetUtime, request.to)) {
    return wrong("from_utime and to_utime are not times in us before 2100");
  }
  if (request.from >= request.to) return wrong("to_utime is not after from_utime");
  if (request.to - request.from > kMaxFleetSpan) return wrong("more than 20 years");
  if (request.kind != Kind::kCurve) return request;
  if (!ReadName(json, "device", request.device)) return wrong("device is not a name of 1 to 128 bytes");
  if (!ReadName(json, "column", request.column) || FindCurveColumn(request.column) == nullptr)
    return wrong("unknown column");
  return request;
}

}  // namespace axlecast
