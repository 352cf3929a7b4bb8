#include "platform/net/group_check.h"

#include <arpa/inet.h>
#include <linux/filter.h>
#include <poll.h>
#include <sys/random.h>
#include <sys/socket.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstdint>
#include <cstring>

#include "core/messages/lcm_url.h"
#include "platform/net/group_socket.h"
#include "platform/net/network_interface.h"
#include "platform/os/descriptor.h"
#include "platform/os/system_clock.h"

namespace axlecast {
namespace {

constexpr MonoNs kProbeTime = kSecond;
constexpr std::size_t kTokenAt = 22;  // in a self test: behind header, channel and NUL

tl::unexpected<Error> MulticastProblem(const LcmUrl& url, const std::string& cause) {
  std::string text = "multicast on this host is not usable: " + cause;
  if (url.interface.empty()) {
    text +=
        "\nFix it (as root), for LCM within this host:\n"
        "  ip link set lo up multicast on\n"
        "  ip route add 224.0.0.0/4 dev lo";
  }
  return Failure(text + "\nA firewall must let the group's UDP port pass.");
}

tl::unexpected<Error> SystemProblem(const LcmUrl& url, const char* action) {
  return MulticastProblem(url, std::string(action) + ": " + std::strerror(errno));
}

using SelfTestDatagram = std::array<std::uint8_t, 30>;

// Every LCM process sends this to itself when it first subscribes. Other processes ignore it.
SelfTestDatagram SelfTest() {
  SelfTestDatagram datagram{'L', 'C', '0', '2', 0, 0, 0, 0};  // short header, sequence number 0
  std::memcpy(datagram.data() + 8, "LCM_SELF_TEST", 14);
  if (getrandom(datagram.data() + kTokenAt, 8, 0) != 8) datagram[kTokenAt] = 1;
  return datagram;
}

// Drops the other traffic of the group, which could fill the buffer of the socket before the self test arrives. Without support
// of the kernel, nothing is dropped.
void TakeOnly(int receiver, const SelfTestDatagram& datagram) {
  constexpr std::uint32_t kUdpHeader = 8;
  std::uint32_t token = 0;
  std::memcpy(&token, datagram.data() + kTokenAt, sizeof token);
  std::array<sock_filter, 4> steps = {{BPF_STMT(BPF_LD | BPF_W | BPF_ABS, kUdpHeader + kTokenAt),
                                       BPF_JUMP(BPF_JMP | BPF_JEQ | BPF_K, ntohl(token), 0, 1),
                                       BPF_STMT(BPF_RET | BPF_K, 0xFFFFFFFF), BPF_STMT(BPF_RET | BPF_K, 0)}};
  const sock_fprog program{steps.size(), steps.data()};
  static_cast<void>(setsockopt(receiver, SOL_SOCKET, SO_ATTACH_FILTER, &program, sizeof program));
}

bool Arrives(int receiver, const SelfTestDatagram& datagram) {
  const SystemClock clock;
  const MonoNs deadline = clock.Now() + kProbeTime;
  std::array<pollfd, 1> files = {{{receiver, POLLIN, 0}}};
  while (clock.Now() < deadline && PollUntil(files, deadline, clock) > 0) {
    std::array<std::uint8_t, 64> received;
    const ssize_t size = recv(receiver, received.data(), received.size(), MSG_DONTWAIT);
    if (size == static_cast<ssize_t>(datagram.size()) &&
        std::equal(datagram.begin(), datagram.end(), received.begin())) {
      return true;
    }
  }
  return false;
}

Result<> ProbeGroup(const LcmUrl& url, unsigned interface) {
  const GroupAddress group(url);
  const Descriptor receiver = OpenGroupSocket(group);
  const Descriptor sender = OpenGroupSocket(group);
  if (!receiver.valid() || !sender.valid()) return SystemProblem(url, "opening a socket");
  const SelfTestDatagram datagram = SelfTest();
  TakeOnly(receiver.get(), datagram);
  if (!JoinGroup(receiver.get(), group, interface)) return SystemProblem(url, "joining the group");
  if (Result<> bound = BindToGroup(receiver.get(), group); !bound) return bound;
  if (!SetTtl(sender.get(), group, url.ttl) || !SetOutgoing(sender.get(), group, interface)) {
    return SystemProblem(url, "setting the options of a socket");
  }
  if (sendto(sender.get(), datagram.data(), datagram.size(), 0, group.generic(), group.size()) < 0) {
    if (interface != 0 && IsInterfaceError(errno)) return {};  // it went down, or has no IPv6 address yet
    return SystemProblem(url, "sending to the group");
  }
  if (Arrives(receiver.get(), datagram)) return {};
  return MulticastProblem(url, "a datagram to " + url.group + " did not come back within 1 s");
}

}  // namespace

Result<> CheckMulticast(const std::string& url) {
  const auto parsed = ParseLcmUrl(url);
  if (!parsed) return Failure("the LCM URL '" + url + "' " + parsed.error().text);
  if (parsed->in_process) return {};
  if (parsed->interface.empty()) return ProbeGroup(*parsed, 0);
  const Result<NetworkInterface> interface = FindInterface(parsed->interface);
  if (!interface || !interface->up) return {};
  return ProbeGroup(*parsed, interface->index);
}

}  // namespace axlecast
