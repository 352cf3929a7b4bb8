#pragma once

#include <sys/types.h>

#include <string>

namespace axlecast {

// A process that has this terminal as its controlling terminal: "bash, process 4711". Empty when there is none that
// this process can see: a process of the same user is always seen, one of another process namespace never.
// `file_system` is that of a pseudo-terminal's node, for each container can have ptys of its own with the same
// numbers; 0: any.
[[nodiscard]] std::string SessionOn(dev_t terminal, dev_t file_system);

}  // namespace axlecast
