#include "tools/doctor/host/host_network.h"

#include <arpa/inet.h>
#include <linux/if.h>
#include <linux/rtnetlink.h>
#include <netinet/in.h>
#include <sys/ioctl.h>
#include <sys/socket.h>

#include <array>
#include <cerrno>
#include <cstddef>
#include <cstdint>
#include <cstring>

#include "platform/os/descriptor.h"

namespace axlecast {
namespace {

// "By which interface would a packet to this address go?" (rtnetlink(7))
struct RouteQuestion {
  nlmsghdr header{};
  rtmsg route{};
  rtattr destination_header{};
  in_addr destination{};
};
static_assert(sizeof(RouteQuestion) == 16 + 12 + 4 + 4, "as netlink lays it out");

using RouteReply = std::array<std::uint8_t, 4096>;

template <typename T>
T ReadAt(const RouteReply& reply, std::size_t at) {
  T value{};
  if (at + sizeof value <= reply.size()) std::memcpy(&value, reply.data() + at, sizeof value);
  return value;
}

std::string NameOfInterface(int descriptor, int index) {
  ifreq request{};
  request.ifr_ifindex = index;
  return ioctl(descriptor, SIOCGIFNAME, &request) == 0 ? request.ifr_name : "";
}

// The index of the interface that the reply names; 0: none. `error`: of a refusal.
int InterfaceIndex(const RouteReply& reply, std::size_t size, int& error) {
  const auto header = ReadAt<nlmsghdr>(reply, 0);
  if (header.nlmsg_type == NLMSG_ERROR) {
    error = -ReadAt<nlmsgerr>(reply, sizeof header).error;
    return 0;
  }
  if (header.nlmsg_type != RTM_NEWROUTE) return 0;
  std::size_t at = sizeof(nlmsghdr) + sizeof(rtmsg);
  while (at + sizeof(rtattr) <= size) {
    const auto attribute = ReadAt<rtattr>(reply, at);
    if (attribute.rta_len < sizeof attribute) return 0;
    if (attribute.rta_type == RTA_OIF) return ReadAt<int>(reply, at + sizeof attribute);
    at += (attribute.rta_len + std::size_t{3}) & ~std::size_t{3};
  }
  return 0;
}

}  // namespace

MulticastRoute FindMulticastRoute(const std::string& group) {
  MulticastRoute route;
  const Descriptor netlink(socket(AF_NETLINK, SOCK_RAW | SOCK_CLOEXEC, NETLINK_ROUTE));
  RouteQuestion question;
  question.header.nlmsg_len = sizeof question;
  question.header.nlmsg_type = RTM_GETROUTE;
  question.header.nlmsg_flags = NLM_F_REQUEST;
  question.route.rtm_family = AF_INET;
  question.route.rtm_dst_len = 32;
  question.destination_header = {sizeof(rtattr) + sizeof(in_addr), RTA_DST};
  inet_pton(AF_INET, group.c_str(), &question.destination);
  RouteReply reply{};
  // The kernel answers before the send returns.
  if (send(netlink.get(), &question, sizeof question, 0) < 0) return route;
  const ssize_t size = recv(netlink.get(), reply.data(), reply.size(), MSG_DONTWAIT);
  if (size < 0) return route;
  const int index = InterfaceIndex(reply, static_cast<std::size_t>(size), route.error);
  if (index > 0) route.interface = NameOfInterface(netlink.get(), index);
  return route;
}

LoopbackState ReadLoopback() {
  const Descriptor any(socket(AF_INET, SOCK_DGRAM | SOCK_CLOEXEC, 0));
  ifreq request{};
  std::strncpy(request.ifr_name, "lo", sizeof request.ifr_name - 1);
  if (ioctl(any.get(), SIOCGIFFLAGS, &request) != 0) return {};
  const auto flags = static_cast<unsigned>(request.ifr_flags);
  return {.known = true, .up = (flags & IFF_UP) != 0, .multicast = (flags & IFF_MULTICAST) != 0};
}

}  // namespace axlecast
