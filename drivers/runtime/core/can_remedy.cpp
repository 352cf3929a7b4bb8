#include "drivers/runtime/core/can_remedy.h"

namespace axlecast {

std::string CanUpLine(std::string_view interface, std::int64_t bitrate) {
  return "ip link set " + std::string(interface) + " up type can bitrate " +
         (bitrate > 0 ? std::to_string(bitrate) : std::string("BITRATE")) + " restart-ms 100";
}

std::string CanAgainLine(std::string_view interface, std::int64_t bitrate) {
  return "ip link set " + std::string(interface) + " down; " + CanUpLine(interface, bitrate);
}

std::string CanRestartLine(std::string_view interface) {
  return "ip link set " + std::string(interface) + " type can restart";
}

}  // namespace axlecast
