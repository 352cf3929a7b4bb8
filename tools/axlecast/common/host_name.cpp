#include "tools/axlecast/common/host_name.h"

#include <unistd.h>

#include <array>

namespace axlecast {

std::string HostName() {
  std::array<char, 256> host{};
  return gethostname(host.data(), host.size() - 1) == 0 ? host.data() : "";
}

}  // namespace axlecast
