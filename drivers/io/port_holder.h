#pragma once

#include <string>

namespace axlecast {

// Another process that has this device open: "axlecast-tformat, process 4711". Empty when there is none, or none that
// this process may see (root sees all).
[[nodiscard]] std::string PortHolder(const std::string& path);

}  // namespace axlecast
