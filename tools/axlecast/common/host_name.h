#pragma once

#include <string>

namespace axlecast {

// This host's name; empty where it has none.
[[nodiscard]] std::string HostName();

}  // namespace axlecast
