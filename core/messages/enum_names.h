#pragma once

#include <cstdint>
#include <span>
#include <string>
#include <string_view>
#include <vector>

namespace axlecast {

// A constant of a .lcm file: UNIT_MM = 4 is {4, "mm"}. The generated message_json_names.h has all of them.
struct NumberName {
  std::int32_t number;
  std::string_view name;
};
using NumberNames = std::span<const NumberName>;

// Returns the names of the bits that are set; bits without a name as one hexadecimal number at the end.
[[nodiscard]] std::vector<std::string> BitNames(std::uint32_t bits, NumberNames names);

// The words of the messages' numbers, for people. A number that is not known becomes "?".

[[nodiscard]] std::string_view UnitName(std::int8_t unit);          // position_t UNIT_*: "mm"
[[nodiscard]] std::string_view DeviceStateName(std::int8_t state);  // device_info_t STATE_*: "ONLINE"
[[nodiscard]] std::string_view BusStateName(std::int8_t state);     // bus_health_t STATE_*: "UP"
[[nodiscard]] std::string_view AlarmStateName(std::int8_t state);   // alarm_entry_t STATE_*: "live"
[[nodiscard]] std::string_view SeverityName(std::int8_t severity);  // alarm_entry_t SEVERITY_*: "warning"

// position_t FLAG_* as words, in the order of their bits: "valid,turns_valid,simulated". Unknown bits as hex.
[[nodiscard]] std::string FlagNames(std::int32_t flags);

// motor_health_t status_bits and trip factors, in the order of their bits: "power upper A, overheat". Unknown bits as hex.
[[nodiscard]] std::string MotorStatusNames(std::int32_t bits);

// The counters of failed readings that are not 0 (device_info_t ERROR_*): "timeout 3, checksum 1".
[[nodiscard]] std::string ErrorCounts(const std::int64_t (&errors)[16]);

// The constants of command_status_t as words: STATE_SUCCEEDED is "succeeded", REASON_NO_PERMIT "no_permit".
// "unknown" for a value that this version does not know.
[[nodiscard]] std::string_view StateName(std::int8_t state);
[[nodiscard]] std::string_view ReasonName(std::int32_t reason);
[[nodiscard]] std::string_view FindingName(std::int8_t finding);
// FINDING_* of a change `finding` (OperationSpec::verified_by_operation); FINDING_CANNOT_TELL for any other word.
[[nodiscard]] std::int8_t FindingOf(std::string_view word);

// Whether what was refused for this reason may be accepted later, as it is: the state of the machine is in the way, and
// neither the command, nor who sends it, nor the machine's file. False for a reason that this version does not know.
[[nodiscard]] bool IsTemporary(std::int32_t reason);

[[nodiscard]] bool IsFinalState(std::int8_t state);

}  // namespace axlecast
