// Any text as an LCM URL, and as the interface of one: no crash. What is accepted can be used as it is, and stays accepted with an
// interface.
#include <arpa/inet.h>

#include <cstdlib>
#include <string>
#include <string_view>

#include "core/messages/lcm_url.h"

namespace {

void Check(const axlecast::LcmUrl& url) {
  in6_addr address{};
  const int family = url.IsIPv6() ? AF_INET6 : AF_INET;
  if (url.group.find('\0') != std::string::npos) std::abort();
  if (inet_pton(family, url.group.c_str(), &address) != 1) std::abort();
  if (url.port < 1 || url.port > 65'535 || url.ttl < 0 || url.ttl > 255) std::abort();
  if (!url.interface.empty() && !axlecast::IsInterface(url.interface)) std::abort();
  if (url.IsIPv6() && url.interface.empty()) std::abort();
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const std::string text(reinterpret_cast<const char*>(data), size);
  // Without the beginning that every URL has, few inputs would reach the options.
  for (const std::string& url : {text, "udpm://" + text, "udpm://239.255.76.67:7667?" + text}) {
    const auto parsed = axlecast::ParseLcmUrl(url);
    if (!parsed) {
      if (parsed.error().text.empty()) std::abort();
      continue;
    }
    if (parsed->in_process) continue;
    Check(*parsed);
    const bool had_one = !parsed->interface.empty();
    if (axlecast::ParseLcmUrl(axlecast::WithInterface(url, "eth1")).has_value() == had_one) std::abort();
  }
  if (axlecast::IsInterface(text)) {
    const auto parsed = axlecast::ParseLcmUrl(axlecast::WithInterface("udpm://239.255.76.67:7667?ttl=1", text));
    if (!parsed || parsed->interface != text) std::abort();
  }
  return 0;
}
