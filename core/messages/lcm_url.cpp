#include "core/messages/lcm_url.h"

#include <arpa/inet.h>

#include <algorithm>
#include <optional>

#include "core/base/spelling.h"

namespace axlecast {
namespace {

constexpr const char* kExample = "e.g. udpm://239.255.76.67:7667?ttl=0";
constexpr std::size_t kLongestInterfaceName = 15;  // of Linux: IFNAMSIZ with its NUL
constexpr unsigned kSiteScope = 5;                 // RFC 4291, section 2.7
constexpr std::array<std::uint8_t, 12> kIPv4Prefix = {0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0xff, 0xff};

// Removes and returns the part before `separator`; all of the text if it does not contain `separator`.
std::string_view Next(std::string_view& rest, char separator) {
  const std::size_t end = rest.find(separator);
  const std::string_view head = rest.substr(0, end);
  rest = end == std::string_view::npos ? std::string_view() : rest.substr(end + 1);
  return head;
}

// Parses an address as inet_pton does, and refuses a NUL, at which inet_pton would end.
bool ParseAddress(int family, const std::string& text, void* address) {
  return text.find('\0') == std::string::npos && inet_pton(family, text.c_str(), address) == 1;
}

// Returns the bits of an address of this kind; 0 if the text is no address.
int AddressBits(const std::string& text) {
  in6_addr address{};
  if (ParseAddress(AF_INET, text, &address)) return 32;
  return ParseAddress(AF_INET6, text, &address) ? 128 : 0;
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
  } else if (name == "interface") {
    if (!url.interface.empty()) return Failure("has two interfaces: right is one");
    if (!IsInterface(option)) return Failure("has a bad interface: " + Quoted(option) + kInterfaceRule);
    url.interface = option;
  } else {
    return Failure("has the unknown option '" + std::string(name) +
                   "': known are ttl, recv_buf_size and interface");
  }
  return {};
}

Result<> CheckGroup(const std::string& group, bool in_brackets) {
  in_addr v4{};
  if (!in_brackets && ParseAddress(AF_INET, group, &v4) && IN_MULTICAST(ntohl(v4.s_addr))) return {};
  in6_addr v6{};
  if (!in_brackets || !ParseAddress(AF_INET6, group, &v6) || !IN6_IS_ADDR_MULTICAST(&v6)) {
    return Failure("has no multicast group (224.0.0.0 to 239.255.255.255, or IPv6 in brackets: [ff15::4c43]), " +
                   std::string(kExample));
  }
  // The kernel binds a socket of a smaller scope to one interface for ever: it would not survive that the interface is deleted.
  if ((v6.s6_addr[1] & 0x0FU) >= kSiteScope) return {};
  return Failure("has an IPv6 group below site scope: use ff15::, e.g. udpm://[ff15::4c43]:7667?ttl=1");
}

}  // namespace

bool IsOtherProvider(std::string_view url) { return url.starts_with("tcpq://") || url.starts_with("file://"); }

bool IsInterface(std::string_view text) {
  std::string_view length = text;
  const std::string address(Next(length, '/'));
  const int bits = AddressBits(address);
  if (text.find('/') != std::string_view::npos) return bits > 0 && ParseInteger(length, 1, bits).has_value();
  if (bits > 0) return true;
  // A name is free of what ends an option, an address or a path; dev_valid_name of Linux.
  return !text.empty() && text.size() <= kLongestInterfaceName && text != "." && text != ".." &&
         std::ranges::all_of(text, [](char c) {
           return c > ' ' && c < '\x7f' && std::string_view("/:&?=%\"'").find(c) == std::string_view::npos;
         });
}

std::string WithInterface(const std::string& url, std::string_view interface) {
  if (!url.starts_with("udpm://")) return url;
  std::string separator = url.find('?') == std::string::npos ? "?" : "&";
  if (url.ends_with('?') || url.ends_with('&')) separator.clear();
  return url + separator + "interface=" + std::string(interface);
}

Result<LcmUrl> ParseLcmUrl(std::string_view url) {
  LcmUrl parsed;
  if (url == "memq://") {
    parsed.in_process = true;
    return parsed;
  }
  if (!url.starts_with("udpm://")) return Failure("is no udpm:// URL, " + std::string(kExample));
  std::string_view options = url.substr(7);
  std::string_view address = Next(options, '?');
  const bool in_brackets = address.starts_with('[');
  if (in_brackets) {
    address.remove_prefix(1);
    parsed.group = std::string(Next(address, ']'));
    if (!address.starts_with(':')) address = {};
    if (!address.empty()) address.remove_prefix(1);
  } else {
    parsed.group = std::string(Next(address, ':'));
  }
  parsed.port = ParseInteger(address, 1, 65535).value_or(0);
  if (Result<> group = CheckGroup(parsed.group, in_brackets); !group) return Failure(group.error());
  if (parsed.port == 0) return Failure("has no port (1 to 65535), " + std::string(kExample));
  while (!options.empty()) {
    if (Result<> taken = TakeOption(parsed, Next(options, '&')); !taken) return Failure(taken.error());
  }
  if (in_brackets && parsed.interface.empty()) {
    return Failure("has an IPv6 group and no interface: set `lcm: {interface: eth1}`, or add interface=eth1");
  }
  return parsed;
}

std::string SenderText(const SenderAddress& sender) {
  std::array<char, INET6_ADDRSTRLEN> text{};
  const bool is_ipv4 = std::equal(kIPv4Prefix.begin(), kIPv4Prefix.end(), sender.address.begin());
  const std::uint8_t* address = sender.address.data() + (is_ipv4 ? kIPv4Prefix.size() : 0);
  inet_ntop(is_ipv4 ? AF_INET : AF_INET6, address, text.data(), text.size());
  const std::string port = ':' + std::to_string(sender.port);
  return is_ipv4 ? text.data() + port : '[' + std::string(text.data()) + ']' + port;
}

}  // namespace axlecast
