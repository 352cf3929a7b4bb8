#include "platform/net/group_socket.h"

#include <arpa/inet.h>
#include <netinet/in.h>

#include <cerrno>
#include <cstring>

namespace axlecast {
namespace {

constexpr int kIPv6MulticastAll = 29;  // IPV6_MULTICAST_ALL of linux/in6.h, which glibc 2.36 does not have

ip_mreqn Membership(const GroupAddress& group, unsigned interface) {
  ip_mreqn membership{};
  membership.imr_multiaddr = reinterpret_cast<const sockaddr_in*>(group.generic())->sin_addr;
  membership.imr_ifindex = static_cast<int>(interface);
  return membership;
}

ipv6_mreq Membership6(const GroupAddress& group, unsigned interface) {
  return {.ipv6mr_multiaddr = reinterpret_cast<const sockaddr_in6*>(group.generic())->sin6_addr,
          .ipv6mr_interface = interface};
}

}  // namespace

GroupAddress::GroupAddress(const LcmUrl& url) {
  const auto port = htons(static_cast<std::uint16_t>(url.port));
  if (url.IsIPv6()) {
    auto& address = *reinterpret_cast<sockaddr_in6*>(&storage_);
    address.sin6_family = AF_INET6;
    address.sin6_port = port;
    inet_pton(AF_INET6, url.group.c_str(), &address.sin6_addr);
    size_ = sizeof address;
  } else {
    auto& address = *reinterpret_cast<sockaddr_in*>(&storage_);
    address.sin_family = AF_INET;
    address.sin_port = port;
    inet_pton(AF_INET, url.group.c_str(), &address.sin_addr);
    size_ = sizeof address;
  }
}

Descriptor OpenGroupSocket(const GroupAddress& group, int flags) {
  return Descriptor(socket(group.family(), SOCK_DGRAM | SOCK_CLOEXEC | flags, 0));
}

Result<> BindToGroup(int socket, const GroupAddress& group) {
  const int on = 1;
  const int off = 0;
  const bool is_ipv6 = group.family() == AF_INET6;
  if (!SetOption(socket, SOL_SOCKET, SO_REUSEADDR, on) ||
      !(is_ipv6 ? SetOption(socket, IPPROTO_IPV6, kIPv6MulticastAll, off)
                : SetOption(socket, IPPROTO_IP, IP_MULTICAST_ALL, off))) {
    return Failure(std::string("a socket option of LCM's port cannot be set: ") + std::strerror(errno));
  }
  if (bind(socket, group.generic(), group.size()) == 0) return {};
  return Failure(std::string("the port of LCM cannot be used: ") + std::strerror(errno) +
                 "; another program holds it without sharing (ss -ulpn shows which)");
}

bool JoinGroup(int socket, const GroupAddress& group, unsigned interface) {
  if (group.family() == AF_INET6)
    return SetOption(socket, IPPROTO_IPV6, IPV6_ADD_MEMBERSHIP, Membership6(group, interface));
  return SetOption(socket, IPPROTO_IP, IP_ADD_MEMBERSHIP, Membership(group, interface));
}

void LeaveGroup(int socket, const GroupAddress& group, unsigned interface) {
  if (group.family() == AF_INET6) {
    static_cast<void>(SetOption(socket, IPPROTO_IPV6, IPV6_DROP_MEMBERSHIP, Membership6(group, interface)));
  } else {
    static_cast<void>(SetOption(socket, IPPROTO_IP, IP_DROP_MEMBERSHIP, Membership(group, interface)));
  }
}

bool SetTtl(int socket, const GroupAddress& group, int ttl) {
  if (group.family() == AF_INET6) return SetOption(socket, IPPROTO_IPV6, IPV6_MULTICAST_HOPS, ttl);
  return SetOption(socket, IPPROTO_IP, IP_MULTICAST_TTL, static_cast<unsigned char>(ttl));
}

bool SetOutgoing(int socket, const GroupAddress& group, unsigned interface) {
  const int index = static_cast<int>(interface);
  if (group.family() == AF_INET6) return SetOption(socket, IPPROTO_IPV6, IPV6_MULTICAST_IF, index);
  ip_mreqn outgoing{};
  outgoing.imr_ifindex = index;
  return SetOption(socket, IPPROTO_IP, IP_MULTICAST_IF, outgoing);
}

bool IsInterfaceError(int error) {
  return error == ENODEV || error == ENXIO || error == ENETDOWN || error == ENETUNREACH || error == EADDRNOTAVAIL;
}

}  // namespace axlecast
