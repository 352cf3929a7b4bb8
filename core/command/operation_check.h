#pragma once

#include <axlecast/argument_t.hpp>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "core/device/family.h"
#include "core/device/operation.h"

namespace axlecast {

// Why something is refused: a command_status_t REASON_*, the cause and what would be right.
struct Refusal {
  std::int32_t reason = 0;
  std::string text;
};

// Operations beside a family's own: those about alarms, which every device has, and those about the datum, which every
// encoder has. The driver carries out all of them but undo_datum and accept_exchange, which are the bridge's.
[[nodiscard]] std::span<const OperationSpec> RuntimeOperations(const Family& family);

// The family's operation of that name, else the runtime's own, else null.
[[nodiscard]] const OperationSpec* FindOperation(const Family& family, std::string_view name);

// One of the runtime's own (RuntimeOperations): it works on the driver alone, and needs no device.
[[nodiscard]] bool IsOfRuntime(const Family& family, const OperationSpec& operation);

// Those of the runtime's own that are about alarms.
inline constexpr std::string_view kAcknowledgeAlarm = "acknowledge_alarm";
inline constexpr std::string_view kShelveAlarm = "shelve_alarm";
inline constexpr std::string_view kUnshelveAlarm = "unshelve_alarm";
inline constexpr std::string_view kRestoreAcknowledgement = "restore_acknowledgement";
[[nodiscard]] bool IsAboutAlarms(std::string_view operation);

// For a refusal: "operations of tformat: clear_errors, ...". Leaves out the internal ones.
[[nodiscard]] std::string OperationNames(const Family& family);

// Names that the operation does not take, that come twice, or that are missing; lengths beyond the limits.
// Values are the device's business.
[[nodiscard]] std::optional<Refusal> CheckArguments(const OperationSpec& operation,
                                                    std::span<const argument_t> arguments);

}  // namespace axlecast
