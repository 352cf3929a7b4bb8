#pragma once

#include <axlecast/command_status_t.hpp>
#include <optional>

#include "bridge/state/pending_command.h"
#include "bridge/store/durable_store.h"
#include "core/base/time.h"
#include "core/config/machine_config.h"
#include "core/device/family.h"

namespace axlecast {

// What has to be done to find out what became of a command that ended INDETERMINATE; nothing when nobody can tell.
[[nodiscard]] std::optional<PendingCommand> OutcomeCheckFor(const PendingCommand& command, const Family& family,
                                                            MonoNs give_up);

// Another look, after kCheckAgain, where the finished task could not read for a reason that may pass: an encoder whose
// memory is busy, or that is read badly. Nothing when its time would be over.
inline constexpr MonoNs kCheckAgain = 500 * kMillisecond;
[[nodiscard]] std::optional<PendingCommand> NextOutcomeCheck(const PendingCommand& finding, MonoNs now);

// Adds to the command's outcome what the finished task found.
void AddCheckedOutcome(const PendingCommand& finding, command_status_t& outcome);

// The task of a command that an earlier bridge has left without outcome. Its operation is null when the machine's
// file has its device or operation no more.
[[nodiscard]] PendingCommand RecoveredCommand(const MachineConfig& machine, const OpenCommand& command);

// The outcome of one that cannot be resumed: it was never sent, or nobody is left to be asked.
void GiveUp(command_status_t& status, Timestamp now);

}  // namespace axlecast
