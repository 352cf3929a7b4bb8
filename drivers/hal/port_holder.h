#pragma once

#include <string>

namespace axlecast {

// Returns another process that has this device open, or that drives this CAN interface as its only master:
// "axlecast-tformat, process 4711". Empty when there is none, or none that this process may see (root sees all).
[[nodiscard]] std::string PortHolder(const std::string& port);

// The abstract name that the driver of a CAN interface binds, without the leading zero byte.
[[nodiscard]] std::string CanLockName(const std::string& interface);

}  // namespace axlecast
