// Any names against a few patterns: the stored result of a name must never differ from its pattern, and the
// memory stays bounded.
#include "platform/net/lcm_receiver.h"

#include <cstdlib>
#include <regex>
#include <string>

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  static const std::regex wanted("(POSITION|DEVICE)/.*");
  axlecast::ChannelSubscriptions subscriptions("p/");
  std::string seen;
  const auto keep = [&seen](const std::string& channel, axlecast::Bytes) { seen = channel; };
  if (!subscriptions.Add("(POSITION|DEVICE)/.*", keep)) std::abort();
  const std::string_view all(reinterpret_cast<const char*>(data), size);
  for (std::size_t at = 0; at < all.size();) {
    const std::string_view channel = all.substr(at, 1 + data[at] % 63);
    at += channel.size();
    const bool matches = channel.starts_with("p/") && std::regex_match(std::string(channel.substr(2)), wanted);
    if ((subscriptions.Dispatch(channel, {}) == 1) != matches) std::abort();
    if (matches && seen != channel.substr(2)) std::abort();
  }
  if (subscriptions.memory() > (512U << 10)) std::abort();
  return 0;
}
