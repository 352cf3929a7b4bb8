#pragma once

#include <axlecast/argument_t.hpp>
#include <span>
#include <string>
#include <string_view>

#include "core/base/result.h"
#include "core/device/family.h"
#include "core/device/operation.h"

namespace axlecast {

// Returns the operations that the driver itself provides: those about alarms for every device, and those about the datum for
// every encoder. The bridge executes undo_datum and accept_exchange, the driver all others.
[[nodiscard]] std::span<const OperationSpec> RuntimeOperations(const Family& family);

// Returns the operation of that name, of the family or of RuntimeOperations; null for an unknown name.
[[nodiscard]] const OperationSpec* FindOperation(const Family& family, std::string_view name);

// Returns true for one of RuntimeOperations: it changes only the driver, and needs no device.
[[nodiscard]] bool IsOfRuntime(const Family& family, const OperationSpec& operation);

// Names of the operations about alarms.
inline constexpr std::string_view kAcknowledgeAlarm = "acknowledge_alarm";
inline constexpr std::string_view kShelveAlarm = "shelve_alarm";
inline constexpr std::string_view kUnshelveAlarm = "unshelve_alarm";
inline constexpr std::string_view kRestoreAcknowledgement = "restore_acknowledgement";
[[nodiscard]] bool IsAboutAlarms(std::string_view operation);

// Returns "operations of tformat: clear_errors, ..." without the internal ones.
[[nodiscard]] std::string OperationNames(const Family& family);

// Refuses names that the operation does not have, names that are given twice or missing, and texts beyond the limits. The
// device checks the values.
[[nodiscard]] Result<> CheckArguments(const OperationSpec& operation, std::span<const argument_t> arguments);

}  // namespace axlecast
