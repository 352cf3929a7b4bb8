#pragma once

#include <axlecast/command_status_t.hpp>
#include <optional>

#include "bridge/state/command_store.h"
#include "bridge/store/durable_store.h"
#include "core/base/time.h"
#include "core/config/machine_config.h"
#include "core/device/family.h"

namespace axlecast {

// Returns the read that verifies a command after INDETERMINATE, or nothing if no read can verify it.
[[nodiscard]] std::optional<PendingCommand> OutcomeCheckFor(const PendingCommand& command, const Family& family,
                                                            MonoNs give_up);

// Returns the same check again, kCheckAgain later, if it failed for a temporary reason: no reply, or the memory is busy.
// Returns nothing if its time would be over.
inline constexpr MonoNs kCheckAgain = 500 * kMillisecond;
[[nodiscard]] std::optional<PendingCommand> NextOutcomeCheck(const PendingCommand& finding, MonoNs now);

// Adds to the command's outcome what the finished command found.
void AddCheckedOutcome(const PendingCommand& finding, command_status_t& outcome);

// The command of a command that an earlier bridge has left without outcome. Its operation is null when the machine's
// file has its device or operation no more.
[[nodiscard]] PendingCommand RecoveredCommand(const MachineConfig& machine, const OpenCommand& command);

// The outcome of one that cannot be resumed: it was never sent, or nobody is left to be asked.
void GiveUp(command_status_t& status, Timestamp now);

}  // namespace axlecast
