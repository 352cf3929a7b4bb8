#include "core/config/listen_address.h"

#include "core/base/spelling.h"
#include "core/config/service_config.h"

namespace axlecast {

Result<ListenAddress> ParseListenAddress(std::string_view text) {
  ListenAddress listen;
  std::string_view port = text;
  if (const std::size_t colon = text.rfind(':'); colon != std::string_view::npos) {
    std::string_view address = text.substr(0, colon);
    const bool brackets = address.starts_with('[') && address.ends_with(']');
    if (brackets) address = address.substr(1, address.size() - 2);
    listen.address = address;
    const bool v6 = address.find(':') != std::string_view::npos;
    if (brackets != v6 || !IsIpAddress(listen.address)) {
      return Failure(Quoted(text) + " does not begin with an address of this host: 192.0.2.7:8381 or [::1]:8381");
    }
    port = text.substr(colon + 1);
  }
  const std::optional<std::int64_t> number = ParseInteger(port, 1, 65'535);
  if (!number) return Failure(Quoted(text) + " has no port from 1 to 65535: 8381 or 192.0.2.7:8381");
  listen.port = static_cast<int>(*number);
  return listen;
}

std::string ListenAddressText(const ListenAddress& listen) {
  const bool v6 = listen.address.find(':') != std::string::npos;
  return (v6 ? '[' + listen.address + ']' : listen.address) + ':' + std::to_string(listen.port);
}

}  // namespace axlecast
