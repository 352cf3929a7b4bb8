#pragma once

#include <string>

namespace axlecast {

// Puts this process (and what it starts from now on) into a network namespace of its own, whose loopback carries
// multicast: an LCM bus that nothing outside hears or disturbs. Without root it takes a user namespace as well.
// Call it before any thread is started. An empty string when done, else the cause and the remedy.
[[nodiscard]] std::string EnterIsolation();

// The line that runs `command` in the namespace of this process, from outside.
[[nodiscard]] std::string EntryLine(const std::string& command);

}  // namespace axlecast
