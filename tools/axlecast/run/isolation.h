#pragma once

#include <sys/types.h>

#include <string>
#include <vector>

namespace axlecast {

// Puts this process (and what it starts from now on) into a network namespace of its own, whose loopback carries
// multicast: an LCM bus that nothing outside hears or disturbs. Without root it takes a user namespace as well.
// Call it before any thread is started. An empty string when done, else the cause and the remedy.
[[nodiscard]] std::string EnterIsolation();

// What runs `command` in the namespace of `process`, from outside, with this folder and environment.
[[nodiscard]] std::vector<std::string> EntryArguments(pid_t process, const std::vector<std::string>& command);
// $SHELL, else /bin/sh.
[[nodiscard]] std::string LoginShell();

}  // namespace axlecast
