#pragma once

#include <cstdint>
#include <string>
#include <string_view>

namespace axlecast {

// What an operator types, as root, about a CAN interface.

// A controller that is down: "ip link set can0 up type can bitrate 250000 restart-ms 100". It then comes back 100 ms
// after a bus-off, unless it cannot (`restarts` false). `bitrate` 0: BITRATE stands for it.
[[nodiscard]] std::string CanUpLine(std::string_view interface, std::int64_t bitrate, bool restarts);
// One that is up already, and must go down before its settings change.
[[nodiscard]] std::string CanAgainLine(std::string_view interface, std::int64_t bitrate, bool restarts);
// After a bus-off, with the settings that it has. Works with every adapter, other than `type can restart`.
[[nodiscard]] std::string CanRestartLine(std::string_view interface);

}  // namespace axlecast
