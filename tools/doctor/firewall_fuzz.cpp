// Whatever nft may print: no crash, and an end.

#include <cstddef>
#include <cstdint>
#include <string>

#include "tools/doctor/firewall.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const std::string ruleset(reinterpret_cast<const char*>(data), size);
  const axlecast::FirewallPacket packet{.group = "239.255.76.67", .port = 7667, .interface = "eth0"};
  static_cast<void>(axlecast::DroppingChain(ruleset, packet));
  return 0;
}
