// Any text is an address with a port or an error; what was read is written and read again without a change.

#include "core/config/listen_address.h"

#include <cstddef>
#include <cstdint>

#include "core/config/service_config.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const auto listen = axlecast::ParseListenAddress({reinterpret_cast<const char*>(data), size});
  if (!listen) return 0;
  if (listen->port < 1 || listen->port > 65'535 || !axlecast::IsIpAddress(listen->address)) __builtin_trap();
  const auto again = axlecast::ParseListenAddress(axlecast::ListenAddressText(*listen));
  if (!again || again->address != listen->address || again->port != listen->port) __builtin_trap();
  return 0;
}
