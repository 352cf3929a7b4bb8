#include "core/device/can.h"

namespace axlecast {

std::string CanUpLine(std::string_view interface, std::int64_t bitrate, bool restarts) {
  return "ip link set " + std::string(interface) + " up type can bitrate " +
         (bitrate > 0 ? std::to_string(bitrate) : std::string("BITRATE")) + (restarts ? " restart-ms 100" : "");
}

std::string CanAgainLine(std::string_view interface, std::int64_t bitrate, bool restarts) {
  return "ip link set " + std::string(interface) + " down; " + CanUpLine(interface, bitrate, restarts);
}

std::string CanRestartLine(std::string_view interface) {
  const std::string set = "ip link set " + std::string(interface);
  return set + " down; " + set + " up";
}

}  // namespace axlecast
