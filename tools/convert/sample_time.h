#pragma once

#include <cstdint>

#include "tools/log/log_event.h"

namespace axlecast {

// us, UNIX time of the instant that the event's message speaks of: its `utime` where its type has one that can be a
// time, else that of its reception. From 1970 to 9999. The message itself is not decoded, and may be malformed.
[[nodiscard]] std::int64_t SampleTime(const LogEvent& event);

}  // namespace axlecast
