#include "core/messages/enum_names.h"

#include <array>
#include <axlecast/command_status_t.hpp>
#include <cstddef>
#include <cstdio>
#include <span>

#include "core/device/reading.h"

namespace axlecast {
namespace {

std::string_view NameAt(std::span<const std::string_view> names, std::int64_t index,
                        std::string_view unknown = "?") {
  return index >= 0 && index < std::ssize(names) ? names[static_cast<std::size_t>(index)] : unknown;
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

// Indexed by the constants of command_status_t.
constexpr std::array<std::string_view, 10> kStates = {"unknown",   "accepted",     "routed", "running",
                                                      "succeeded", "rejected",     "failed", "expired",
                                                      "cancelled", "indeterminate"};
constexpr std::array<std::string_view, 4> kFindings = {"none", "effect_seen", "no_effect_seen", "cannot_tell"};
constexpr std::string_view kReasons[] = {"none",
                                         "unknown_device",
                                         "unknown_operation",
                                         "bad_argument",
                                         "id_reused",
                                         "stale_bridge",
                                         "malformed",
                                         "bad_signature",
                                         "unsigned",
                                         "denied",
                                         "queue_full",
                                         "busy",
                                         "driver_absent",
                                         "not_standing_still",
                                         "no_permit",
                                         "epoch",
                                         "device_offline",
                                         "device_alarm",
                                         "not_permitted",
                                         "wear",
                                         "unsupported_mode",
                                         "journal",
                                         "deadline",
                                         "cancelled",
                                         "no_reply",
                                         "read_back_differs",
                                         "device_refused",
                                         "driver_restarted",
                                         "driver_silent",
                                         "stopping",
                                         "wrong_identity",
                                         "token",
                                         "moved_during_sequence",
                                         "fenced",
                                         "no_datum",
                                         "bridge_restarted"};

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

std::string_view StateName(std::int8_t state) { return NameAt(kStates, state, "unknown"); }
std::string_view ReasonName(std::int32_t reason) { return NameAt(kReasons, reason, "unknown"); }
std::string_view FindingName(std::int8_t finding) { return NameAt(kFindings, finding, "unknown"); }

std::int8_t FindingOf(std::string_view word) {
  if (word == "reads_as_after") return command_status_t::FINDING_EFFECT_SEEN;
  if (word == FindingName(command_status_t::FINDING_NO_EFFECT_SEEN))
    return command_status_t::FINDING_NO_EFFECT_SEEN;
  return command_status_t::FINDING_CANNOT_TELL;
}

bool IsTemporary(std::int32_t reason) {
  switch (reason) {
    case command_status_t::REASON_STALE_BRIDGE:  // the present boot of the bridge takes it
    case command_status_t::REASON_QUEUE_FULL:
    case command_status_t::REASON_BUSY:
    case command_status_t::REASON_DRIVER_ABSENT:
    case command_status_t::REASON_NOT_STANDING_STILL:
    case command_status_t::REASON_NO_PERMIT:
    case command_status_t::REASON_DEVICE_OFFLINE:
    case command_status_t::REASON_JOURNAL:
    case command_status_t::REASON_DEADLINE:
    case command_status_t::REASON_STOPPING:
    case command_status_t::REASON_MOVED_DURING_SEQUENCE:
    case command_status_t::REASON_FENCED:
    case command_status_t::REASON_BRIDGE_RESTARTED:
      return true;
    default:
      return false;
  }
}

bool IsFinalState(std::int8_t state) {
  return state >= command_status_t::STATE_SUCCEEDED && state <= command_status_t::STATE_INDETERMINATE;
}

}  // namespace axlecast
