#include "core/messages/json/names.h"

#include <array>
#include <cstddef>
#include <cstdio>
#include <span>

#include "core/device/sample.h"

namespace axlecast {
namespace {

std::string_view NameAt(std::span<const std::string_view> names, std::int8_t index) {
  return index >= 0 && static_cast<std::size_t>(index) < names.size() ? names[static_cast<std::size_t>(index)]
                                                                      : "?";
}

// Bits without a name as hex.
std::string BitNames(std::uint32_t bits, std::span<const std::string_view> names, std::string_view separator) {
  std::string text;
  const auto add = [&](std::string_view name) {
    if (!text.empty()) text += separator;
    text += name;
  };
  for (std::size_t bit = 0; bit < names.size(); ++bit) {
    const std::uint32_t mask = 1U << bit;
    if ((bits & mask) == 0 || names[bit].empty()) continue;
    bits &= ~mask;
    add(names[bit]);
  }
  if (bits != 0) {
    std::array<char, 16> hex{};
    static_cast<void>(std::snprintf(hex.data(), hex.size(), "0x%x", bits));
    add(hex.data());
  }
  return text;
}

}  // namespace

std::string_view UnitName(std::int8_t unit) {
  static constexpr std::array<std::string_view, 8> kNames = {"count", "turn", "rad", "deg",
                                                             "mm",    "m",    "um",  "inch"};
  return NameAt(kNames, unit);
}

std::string_view DeviceStateName(std::int8_t state) {
  static constexpr std::array<std::string_view, 4> kNames = {"STARTING", "ONLINE", "DEGRADED", "OFFLINE"};
  return NameAt(kNames, state);
}

std::string_view BusStateName(std::int8_t state) {
  static constexpr std::array<std::string_view, 4> kNames = {"STARTING", "UP", "DEGRADED", "DOWN"};
  return NameAt(kNames, state);
}

std::string_view AlarmStateName(std::int8_t state) {
  static constexpr std::array<std::string_view, 6> kNames = {"live",           "device_latched", "driver_latched",
                                                             "unacknowledged", "shelved",        "unknown"};
  return NameAt(kNames, state);
}

std::string_view SeverityName(std::int8_t severity) {
  static constexpr std::array<std::string_view, 4> kNames = {"info", "warning", "error", "critical"};
  return NameAt(kNames, severity);
}

std::string FlagNames(std::int32_t flags) {
  static constexpr std::array<std::string_view, 15> kNames = {
      "valid",          "turns_valid",  "turns_wrapped",  "referenced",  "speed_valid",
      "low_accuracy",   "device_error", "device_warning", "implausible", "turns_counted_by_driver",
      "datum_changing", "after_gap",    "clock_stepped",  "simulated",   "redecoded"};
  return BitNames(static_cast<std::uint32_t>(flags), kNames, ",");
}

std::string MotorStatusNames(std::int32_t bits) {
  static constexpr std::array<std::string_view, 7> kNames = {
      "power upper A", "power upper B", "power lower A", "power lower B", "", "overheat", "excessive shock"};
  return BitNames(static_cast<std::uint32_t>(bits), kNames, ", ");
}

std::string ErrorCounts(const std::int64_t (&errors)[16]) {
  static_assert(kErrorKinds == 16);
  std::string text;
  for (std::size_t kind = 0; kind < kErrorKinds; ++kind) {
    if (errors[kind] == 0) continue;
    if (!text.empty()) text += ", ";
    text += std::string(ErrorName(static_cast<ErrorKind>(kind))) + " " + std::to_string(errors[kind]);
  }
  return text;
}

}  // namespace axlecast
