#include "core/messages/enum_names.h"

#include <algorithm>
#include <axlecast/command_status_t.hpp>
#include <cstddef>

#include "core/base/text.h"
#include "core/device/reading.h"
#include "core/messages/json/message_json_names.h"

namespace axlecast {
namespace {

std::string_view NameOf(NumberNames names, std::int64_t number, std::string_view unknown = "?") {
  const auto found =
      std::find_if(names.begin(), names.end(), [number](const auto& one) { return one.number == number; });
  return found == names.end() ? unknown : found->name;
}

std::string Joined(const std::vector<std::string>& words, std::string_view separator) {
  std::string text;
  for (const std::string& word : words) text.append(text.empty() ? "" : separator).append(word);
  return text;
}

}  // namespace

std::vector<std::string> BitNames(std::uint32_t bits, NumberNames names) {
  std::vector<std::string> words;
  for (const NumberName& known : names) {
    const auto mask = static_cast<std::uint32_t>(known.number);
    if ((bits & mask) != 0) words.emplace_back(known.name);
    bits &= ~mask;
  }
  if (bits != 0) words.push_back(Text("0x%x", bits));
  return words;
}

std::string_view UnitName(std::int8_t unit) { return NameOf(kPositionUnitNames, unit); }
std::string_view DeviceStateName(std::int8_t state) { return NameOf(kDeviceInfoStateNames, state); }
std::string_view BusStateName(std::int8_t state) { return NameOf(kBusHealthStateNames, state); }
std::string_view AlarmStateName(std::int8_t state) { return NameOf(kAlarmEntryStateNames, state); }
std::string_view SeverityName(std::int8_t severity) { return NameOf(kAlarmEntrySeverityNames, severity); }

std::string FlagNames(std::int32_t flags) {
  return Joined(BitNames(static_cast<std::uint32_t>(flags), kPositionFlagNames), ",");
}

std::string MotorStatusNames(std::int32_t bits) {
  static constexpr NumberName kNames[] = {{1, "power upper A"}, {2, "power upper B"}, {4, "power lower A"},
                                          {8, "power lower B"}, {32, "overheat"},     {64, "excessive shock"}};
  return Joined(BitNames(static_cast<std::uint32_t>(bits), kNames), ", ");
}

std::string ErrorCounts(const std::int64_t (&errors)[16]) {
  static_assert(kErrorKinds == 16);
  std::vector<std::string> counts;
  for (std::size_t kind = 0; kind < kErrorKinds; ++kind) {
    if (errors[kind] == 0) continue;
    counts.push_back(std::string(ErrorName(static_cast<ErrorKind>(kind))) + " " + std::to_string(errors[kind]));
  }
  return Joined(counts, ", ");
}

std::string_view StateName(std::int8_t state) { return NameOf(kCommandStatusStateNames, state, "unknown"); }
std::string_view ReasonName(std::int32_t reason) { return NameOf(kCommandStatusReasonNames, reason, "unknown"); }
std::string_view FindingName(std::int8_t finding) { return NameOf(kCommandStatusFindingNames, finding, "unknown"); }

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
