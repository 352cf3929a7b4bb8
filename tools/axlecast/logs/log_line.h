#pragma once

#include <string>

#include "tools/log/log_event.h"

namespace axlecast {

// An event as one line of JSON, with its newline: number, received_utime and channel; then a message of ours under its
// type and fields, the text of a header, a seal, or any other event's size and data in hex. `raw`: hex for all.
[[nodiscard]] std::string EventLine(const LogEvent& event, bool raw);

}  // namespace axlecast
