#pragma once

#include <axlecast/command_status_t.hpp>
#include <optional>

#include "bridge/state/pending_command.h"
#include "core/device/family.h"

namespace axlecast {

// What has to be done to find out what became of a command that ended INDETERMINATE; nothing when nobody can tell.
[[nodiscard]] std::optional<PendingCommand> OutcomeCheckFor(const PendingCommand& command, const Family& family,
                                                            MonoNs give_up);

// Another look, after kLookAgain, where the finished task could not read for a reason that may pass: an encoder whose
// memory is busy, or that is read badly. Nothing when its time would be over.
inline constexpr MonoNs kLookAgain = 500 * kMillisecond;
[[nodiscard]] std::optional<PendingCommand> NextLook(const PendingCommand& finding, MonoNs now);

// Adds to the command's outcome what the finished task found.
void AddCheckedOutcome(const PendingCommand& finding, command_status_t& outcome);

}  // namespace axlecast
