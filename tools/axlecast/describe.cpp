#include "tools/axlecast/describe.h"

#include <algorithm>
#include <array>
#include <limits>
#include <numbers>
#include <string_view>

#include "tools/axlecast/columns.h"
#include "tools/axlecast/names.h"
#include "tools/json/field.h"

namespace axlecast {
namespace {

using Json = nlohmann::ordered_json;

double Number(const Json& message, const char* field) {
  const Json& value = message.at(field);
  return value.is_number() ? value.get<double>() : std::numeric_limits<double>::quiet_NaN();
}

std::int8_t Small(const Json& message, const char* field) { return message.at(field).get<std::int8_t>(); }

std::string Text(const Json& message, const char* field) { return message.at(field).get<std::string>(); }

std::string Errors(const Json& message) {
  std::int64_t errors[16] = {};
  const Json& list = message.at("errors");
  for (std::size_t kind = 0; kind < list.size() && kind < std::size(errors); ++kind) {
    errors[kind] = list[kind].get<std::int64_t>();
  }
  const std::string counts = ErrorCounts(errors);
  return counts.empty() ? "" : ", errors: " + counts;
}

std::string Position(const Json& message) {
  return Decimal(Number(message, "value"), 6) + ' ' + std::string(UnitName(Small(message, "unit"))) + ", turns " +
         Decimal(Number(message, "counts") / Number(message, "counts_per_turn"), 6) + ", rpm " +
         Decimal(Number(message, "speed_rad_s") * 60 / (2 * std::numbers::pi), 1) + ", " +
         FlagNames(message.at("flags").get<std::int32_t>());
}

std::string Alarms(const Json& message) {
  std::string text;
  for (const Json& entry : message.at("entries")) {
    text += (text.empty() ? "" : ", ") + Text(entry, "name") + " (" +
            std::string(SeverityName(Small(entry, "severity"))) + ", " +
            std::string(AlarmStateName(Small(entry, "state"))) + ")";
  }
  return text.empty() ? "no alarm" : text;
}

std::string Device(const Json& message) {
  const std::string reason = Text(message, "reason");
  return std::string(DeviceStateName(Small(message, "state"))) + (reason.empty() ? "" : " (" + reason + ")") +
         ", " + Text(message, "family") + ' ' + Text(message, "model") + ", good " + message.at("good").dump() +
         Errors(message);
}

std::string Bus(const Json& message) {
  return std::string(BusStateName(Small(message, "state"))) + ", " + Decimal(Number(message, "rate_hz"), 1) +
         " of " + Decimal(Number(message, "wire_limit_hz"), 0) + " exchanges/s, good " + message.at("good").dump() +
         Errors(message);
}

// Any other message: its fields after the head, as JSON.
std::string Fields(const Json& message) {
  constexpr std::array<std::string_view, 5> kHead = {"utime", "mono_ns", "boot_id", "seq", "spare"};
  Json rest = Json::object();
  for (const auto& [name, value] : message.items()) {
    if (std::find(kHead.begin(), kHead.end(), name) == kHead.end()) rest[name] = value;
  }
  return JsonLine(rest);
}

}  // namespace

std::string Describe(const std::string& type, const Json& message) {
  if (type == "position_t") return Position(message);
  if (type == "alarm_t") return Printable(Alarms(message));
  if (type == "device_info_t") return Printable(Device(message));
  if (type == "bus_health_t") return Printable(Bus(message));
  return Printable(Fields(message));
}

}  // namespace axlecast
