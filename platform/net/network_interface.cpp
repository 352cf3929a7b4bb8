#include "platform/net/network_interface.h"

#include <arpa/inet.h>
#include <ifaddrs.h>
#include <net/if.h>
#include <netinet/in.h>
#include <sys/ioctl.h>

#include <algorithm>
#include <cerrno>
#include <cstdint>
#include <cstring>
#include <memory>
#include <set>
#include <span>
#include <utility>

#include "core/base/spelling.h"
#include "platform/os/descriptor.h"

namespace axlecast {
namespace {

using Addresses = std::unique_ptr<ifaddrs, decltype(&freeifaddrs)>;

Addresses ReadAddresses() {
  ifaddrs* first = nullptr;
  if (getifaddrs(&first) != 0) first = nullptr;
  return {first, &freeifaddrs};
}

// Returns an interface without an index if none has this name.
NetworkInterface Look(const std::string& name) {
  NetworkInterface found{.name = name};
  const Descriptor any(socket(AF_INET, SOCK_DGRAM | SOCK_CLOEXEC, 0));
  ifreq request{};
  std::strncpy(request.ifr_name, name.c_str(), sizeof request.ifr_name - 1);
  if (ioctl(any.get(), SIOCGIFINDEX, &request) != 0) return found;
  const int index = request.ifr_ifindex;
  if (ioctl(any.get(), SIOCGIFFLAGS, &request) != 0) return found;  // deleted since
  const auto flags = static_cast<unsigned>(static_cast<std::uint16_t>(request.ifr_flags));
  found.index = static_cast<unsigned>(index);
  found.up = (flags & IFF_UP) != 0;
  found.carrier = (flags & IFF_RUNNING) != 0;
  found.loopback = (flags & IFF_LOOPBACK) != 0;
  return found;
}

// The bytes of an address of an interface; none if it is neither IPv4 nor IPv6.
std::span<const std::uint8_t> BytesOf(const sockaddr* address, int family) {
  if (address == nullptr || address->sa_family != family) return {};
  if (family == AF_INET) {
    const auto& v4 = reinterpret_cast<const sockaddr_in*>(address)->sin_addr;
    return {reinterpret_cast<const std::uint8_t*>(&v4), sizeof v4};
  }
  return reinterpret_cast<const sockaddr_in6*>(address)->sin6_addr.s6_addr;
}

bool HaveSameBegin(std::span<const std::uint8_t> one, std::span<const std::uint8_t> other, std::size_t bits) {
  for (std::size_t bit = 0; bit < bits; ++bit) {
    if (((one[bit / 8] ^ other[bit / 8]) >> (7 - bit % 8) & 1) != 0) return false;
  }
  return true;
}

// Returns the names of the interfaces with an address that equals `address` in its first `bits`.
std::set<std::string> NamesByAddress(int family, std::span<const std::uint8_t> address, std::size_t bits) {
  std::set<std::string> names;
  const Addresses addresses = ReadAddresses();
  for (const ifaddrs* each = addresses.get(); each != nullptr; each = each->ifa_next) {
    const auto own = BytesOf(each->ifa_addr, family);
    if (own.size() == address.size() && HaveSameBegin(own, address, bits)) names.emplace(each->ifa_name);
  }
  return names;
}

constexpr const char* kUntilThen = ": LCM sends and receives nothing until there is one";

Result<NetworkInterface> FindByAddress(const std::string& text, int family, std::span<const std::uint8_t> address) {
  const std::size_t slash = text.find('/');
  const auto full = static_cast<std::int64_t>(address.size() * 8);
  const auto bits =
      slash == std::string::npos ? full : ParseInteger(text.substr(slash + 1), 1, full).value_or(full);
  const std::set<std::string> names = NamesByAddress(family, address, static_cast<std::size_t>(bits));
  if (names.empty()) {
    return Failure(std::string("no interface of this host has ") +
                   (slash == std::string::npos ? "the address " : "an address in ") + text + kUntilThen +
                   " (`ip -brief address` lists the addresses)");
  }
  if (names.size() > 1) {
    return Failure("several interfaces have an address in " + text + ": " + Listed({names.begin(), names.end()}) +
                   "; give the name or the address of one as `interface`");
  }
  return Look(*names.begin());
}

}  // namespace

std::vector<NetworkInterface> Interfaces() {
  std::set<std::string> names;
  const Addresses addresses = ReadAddresses();
  for (const ifaddrs* each = addresses.get(); each != nullptr; each = each->ifa_next) names.emplace(each->ifa_name);
  std::vector<NetworkInterface> found;
  found.reserve(names.size());
  for (const std::string& name : names) found.push_back(Look(name));
  std::erase_if(found, [](const NetworkInterface& each) { return each.index == 0; });
  return found;
}

Result<NetworkInterface> FindInterface(const std::string& text) {
  const std::string address = text.substr(0, text.find('/'));
  in_addr v4{};
  in6_addr v6{};
  if (inet_pton(AF_INET, address.c_str(), &v4) == 1) {
    return FindByAddress(text, AF_INET, {reinterpret_cast<const std::uint8_t*>(&v4), sizeof v4});
  }
  if (inet_pton(AF_INET6, address.c_str(), &v6) == 1) return FindByAddress(text, AF_INET6, v6.s6_addr);
  NetworkInterface found = Look(text);
  if (found.index != 0) return found;
  return Failure("this host has no interface " + text + kUntilThen + " (`ip -brief link` lists the interfaces)");
}

void InterfaceWatch::Update() {
  const Result<NetworkInterface> found = FindInterface(text_);
  index_ = found ? found->index : 0;
  problem_.clear();
  if (!found) {
    problem_ = found.error().text;
  } else if (!found->up) {
    problem_ = "the interface " + found->name + " is down: LCM sends and receives nothing until `ip link set " +
               found->name + " up`";
  } else if (leaves_host_ && !found->carrier) {
    problem_ = "the interface " + found->name +
               " has no carrier: LCM does not reach other hosts; check the cable and the device at its other end";
  }
}

}  // namespace axlecast
