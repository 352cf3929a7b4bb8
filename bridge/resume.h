#pragma once

#include <axlecast/command_status_t.hpp>

#include "bridge/durable_store.h"
#include "bridge/instant.h"
#include "bridge/task.h"
#include "drivers/runtime/config/machine_config.h"

namespace axlecast {

// The task of a command that an earlier bridge has left without outcome. Its operation is null when the machine's
// file has its device or operation no more.
[[nodiscard]] Task ResumedTask(const MachineConfig& machine, const OpenCommand& command);

// The outcome of one that cannot be resumed: it was never sent, or nobody is left to be asked.
void GiveUp(command_status_t& status, Instant now);

}  // namespace axlecast
