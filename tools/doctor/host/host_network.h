#pragma once

#include <cstdint>
#include <string>
#include <vector>

namespace axlecast {

// How this host would send to a multicast group, without sending.
struct MulticastRoute {
  int error = 0;          // errno of the kernel's refusal: ENETUNREACH
  std::string interface;  // by which it goes; empty when the kernel does not tell
};
[[nodiscard]] MulticastRoute FindMulticastRoute(const std::string& group);

struct LoopbackState {
  bool known = false;
  bool up = false;
  bool multicast = false;
};
[[nodiscard]] LoopbackState ReadLoopback();

}  // namespace axlecast
