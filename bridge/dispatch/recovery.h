#pragma once

#include <axlecast/command_status_t.hpp>

#include "bridge/state/pending_command.h"
#include "bridge/store/durable_store.h"
#include "core/base/time.h"
#include "core/config/machine_config.h"

namespace axlecast {

// The task of a command that an earlier bridge has left without outcome. Its operation is null when the machine's
// file has its device or operation no more.
[[nodiscard]] PendingCommand RecoveredCommand(const MachineConfig& machine, const OpenCommand& command);

// The outcome of one that cannot be resumed: it was never sent, or nobody is left to be asked.
void GiveUp(command_status_t& status, Timestamp now);

}  // namespace axlecast
