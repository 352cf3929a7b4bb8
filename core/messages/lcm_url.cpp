#include "core/messages/lcm_url.h"

#include <arpa/inet.h>

#include <optional>

#include "core/base/spelling.h"

namespace axlecast {
namespace {

constexpr const char* kExample = "e.g. udpm://239.255.76.67:7667?ttl=0";

// Removes and returns the part before `separator`; all of the text if it does not contain `separator`.
std::string_view Next(std::string_view& rest, char separator) {
  const std::size_t end = rest.find(separator);
  const std::string_view head = rest.substr(0, end);
  rest = end == std::string_view::npos ? std::string_view() : rest.substr(end + 1);
  return head;
}

Result<> TakeOption(LcmUrl& url, std::string_view option) {
  const std::string_view name = Next(option, '=');
  if (name == "ttl") {
    const std::optional<std::int64_t> ttl = ParseInteger(option, 0, 255);
    if (!ttl) return Failure("has a bad ttl: right is 0 (this host only) to 255");
    url.ttl = static_cast<int>(*ttl);
  } else if (name == "recv_buf_size") {
    const std::optional<std::int64_t> size = ParseInteger(option, 4096, 1 << 30);
    if (!size) return Failure("has a bad recv_buf_size: right is 4096 to 1073741824 bytes");
    url.recv_buf_size = *size;
  } else {
    return Failure("has the unknown option '" + std::string(name) + "': known are ttl and recv_buf_size");
  }
  return {};
}

bool IsMulticast(const std::string& group) {
  in_addr address{};
  return inet_pton(AF_INET, group.c_str(), &address) == 1 && IN_MULTICAST(ntohl(address.s_addr));
}

}  // namespace

bool IsOtherProvider(std::string_view url) { return url.starts_with("tcpq://") || url.starts_with("file://"); }

Result<LcmUrl> ParseLcmUrl(std::string_view url) {
  LcmUrl parsed;
  if (url == "memq://") {
    parsed.in_process = true;
    return parsed;
  }
  if (!url.starts_with("udpm://")) return Failure("is no udpm:// URL, " + std::string(kExample));
  std::string_view options = url.substr(7);
  std::string_view address = Next(options, '?');
  parsed.group = std::string(Next(address, ':'));
  parsed.port = ParseInteger(address, 1, 65535).value_or(0);
  if (!IsMulticast(parsed.group)) {
    return Failure("has no multicast group (224.0.0.0 to 239.255.255.255), " + std::string(kExample));
  }
  if (parsed.port == 0) return Failure("has no port (1 to 65535), " + std::string(kExample));
  while (!options.empty()) {
    if (Result<> taken = TakeOption(parsed, Next(options, '&')); !taken) return Failure(taken.error());
  }
  return parsed;
}

}  // namespace axlecast
