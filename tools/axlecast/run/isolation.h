#pragma once

#include <sys/types.h>

#include <string>
#include <vector>

#include "core/base/result.h"

namespace axlecast {

// Moves this process and its future children into their own network namespace with multicast on loopback: an LCM bus that
// no other process receives or disturbs. Without root, it also creates a user namespace. Call it before any thread starts.
[[nodiscard]] Result<> EnterIsolation();

// Returns the arguments that run `command` in the namespace of `process`, with the caller's folder and environment.
[[nodiscard]] std::vector<std::string> EntryArguments(pid_t process, const std::vector<std::string>& command);
// Returns $SHELL, else /bin/sh.
[[nodiscard]] std::string LoginShell();

}  // namespace axlecast
