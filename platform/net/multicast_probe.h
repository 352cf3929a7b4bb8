#pragma once

#include <string>

namespace axlecast {

// Sends itself a datagram over the URL's group and port and waits up to 1 s for it. Empty when it came, else the
// cause and the lines that mend it. `axlecast up` asks before it starts anything.
[[nodiscard]] std::string MulticastProblem(const std::string& url);

}  // namespace axlecast
