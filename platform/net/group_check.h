#pragma once

#include <string>

#include "core/base/result.h"

namespace axlecast {

// Sends a datagram to the URL's group and port, by its interface, and waits up to 1 s until it arrives here. The error contains the
// cause and the commands that fix it. `axlecast up` checks this before it starts anything. If the interface of the URL is missing
// or down, nothing is sent, which is no error: ports wait for the interface.
[[nodiscard]] Result<> CheckMulticast(const std::string& url);

}  // namespace axlecast
