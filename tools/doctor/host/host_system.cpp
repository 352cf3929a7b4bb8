#include "tools/doctor/host/host_system.h"

#include <arpa/inet.h>
#include <linux/rtnetlink.h>
#include <net/if.h>
#include <netinet/in.h>
#include <sys/ioctl.h>
#include <sys/resource.h>
#include <sys/socket.h>
#include <sys/timex.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstring>

#include "platform/os/descriptor.h"

namespace axlecast {
namespace {

// Requests the outgoing interface for an address (rtnetlink(7)).
struct RouteRequest {
  nlmsghdr header{};
  rtmsg route{};
  rtattr destination_header{};
  in_addr destination{};
};
static_assert(sizeof(RouteRequest) == 16 + 12 + 4 + 4, "the layout of netlink");

using RouteReply = std::array<std::uint8_t, 4096>;

template <typename T>
T ReadAt(const RouteReply& reply, std::size_t at) {
  T value{};
  if (at + sizeof value <= reply.size()) std::memcpy(&value, reply.data() + at, sizeof value);
  return value;
}

// Returns the index of the interface in the reply; 0 without an interface. Sets `error` if the kernel refused.
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
  RouteRequest request;
  request.header.nlmsg_len = sizeof request;
  request.header.nlmsg_type = RTM_GETROUTE;
  request.header.nlmsg_flags = NLM_F_REQUEST;
  request.route.rtm_family = AF_INET;
  request.route.rtm_dst_len = 32;
  request.destination_header = {sizeof(rtattr) + sizeof(in_addr), RTA_DST};
  inet_pton(AF_INET, group.c_str(), &request.destination);
  RouteReply reply{};
  // The kernel answers before the send returns.
  if (send(netlink.get(), &request, sizeof request, 0) < 0) return route;
  const ssize_t size = recv(netlink.get(), reply.data(), reply.size(), MSG_DONTWAIT);
  if (size < 0) return route;
  const int index = InterfaceIndex(reply, static_cast<std::size_t>(size), route.error);
  std::array<char, IF_NAMESIZE> name{};
  if (if_indextoname(static_cast<unsigned>(index), name.data()) != nullptr) route.interface = name.data();
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

RealtimeLimits ReadRealtimeLimits() {
  if (geteuid() == 0) return {.priority = 99, .locked_bytes = -1};
  rlimit priority{};
  rlimit locked{};
  if (getrlimit(RLIMIT_RTPRIO, &priority) != 0 || getrlimit(RLIMIT_MEMLOCK, &locked) != 0) return {};
  return {.priority = static_cast<std::int64_t>(std::min<rlim_t>(priority.rlim_cur, 99)),
          .locked_bytes = locked.rlim_cur == RLIM_INFINITY ? -1 : static_cast<std::int64_t>(locked.rlim_cur)};
}

ClockSync ReadClockSync() {
  timex answer{};  // modes 0: changes nothing
  const int state = adjtimex(&answer);
  return {.known = state >= 0, .synchronised = state >= 0 && state != TIME_ERROR};
}

}  // namespace axlecast
