#include "platform/net/multicast_probe.h"

#include <arpa/inet.h>
#include <linux/filter.h>
#include <netinet/in.h>
#include <poll.h>
#include <sys/random.h>
#include <sys/socket.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstring>

#include "core/messages/lcm_url.h"
#include "platform/os/descriptor.h"
#include "platform/os/system_clock.h"
#include "platform/os/wait_until.h"

namespace axlecast {
namespace {

constexpr MonoNs kProbeTime = kSecond;
constexpr std::size_t kTokenAt = 22;  // in a self test: behind header, channel and NUL

std::string MulticastRemedy(const std::string& cause) {
  return "multicast on this host is not usable: " + cause +
         "\nMend it (as root), for LCM within this host:\n"
         "  ip link set lo up multicast on\n"
         "  ip route add 224.0.0.0/4 dev lo\n"
         "A firewall must let the group's UDP port pass.";
}

std::string SystemProblem(const char* action) {
  return MulticastRemedy(std::string(action) + ": " + std::strerror(errno));
}

using SelfTestDatagram = std::array<std::uint8_t, 30>;

// What every LCM process sends itself when it first subscribes; others know it and pass over it.
SelfTestDatagram SelfTest() {
  SelfTestDatagram datagram{'L', 'C', '0', '2', 0, 0, 0, 0};  // short header, sequence number 0
  std::memcpy(datagram.data() + 8, "LCM_SELF_TEST", 14);
  if (getrandom(datagram.data() + kTokenAt, 8, 0) != 8) datagram[kTokenAt] = 1;
  return datagram;
}

// Joins the group like any LCM process. An empty string, or the problem.
std::string JoinGroup(int receiver, const sockaddr_in& group) {
  const int on = 1;
  if (setsockopt(receiver, SOL_SOCKET, SO_REUSEADDR, &on, sizeof on) != 0) return SystemProblem("SO_REUSEADDR");
  if (bind(receiver, reinterpret_cast<const sockaddr*>(&group), sizeof group) != 0) {
    return std::string("the port of LCM cannot be used: ") + std::strerror(errno) +
           "; another program holds it without sharing (ss -ulpn shows which)";
  }
  ip_mreq membership{};
  membership.imr_multiaddr = group.sin_addr;
  if (setsockopt(receiver, IPPROTO_IP, IP_ADD_MEMBERSHIP, &membership, sizeof membership) != 0) {
    return SystemProblem("joining the group");
  }
  return "";
}

// Leaves the group's traffic out, which would fill the socket's buffer before the self test comes. A kernel that cannot
// leaves it in.
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

bool Comes(int receiver, const SelfTestDatagram& datagram) {
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

std::string ProbeGroup(const LcmUrl& url) {
  sockaddr_in group{};
  group.sin_family = AF_INET;
  group.sin_port = htons(static_cast<std::uint16_t>(url.port));
  inet_pton(AF_INET, url.group.c_str(), &group.sin_addr);

  const Descriptor receiver(socket(AF_INET, SOCK_DGRAM | SOCK_CLOEXEC, 0));
  const Descriptor sender(socket(AF_INET, SOCK_DGRAM | SOCK_CLOEXEC, 0));
  if (!receiver.valid() || !sender.valid()) return SystemProblem("opening a socket");
  const SelfTestDatagram datagram = SelfTest();
  TakeOnly(receiver.get(), datagram);
  if (std::string problem = JoinGroup(receiver.get(), group); !problem.empty()) return problem;
  const auto ttl = static_cast<unsigned char>(url.ttl);
  if (setsockopt(sender.get(), IPPROTO_IP, IP_MULTICAST_TTL, &ttl, sizeof ttl) != 0) {
    return SystemProblem("IP_MULTICAST_TTL");
  }
  if (sendto(sender.get(), datagram.data(), datagram.size(), 0, reinterpret_cast<const sockaddr*>(&group),
             sizeof group) < 0) {
    return SystemProblem("sending to the group");
  }
  if (Comes(receiver.get(), datagram)) return "";
  return MulticastRemedy("a datagram to " + url.group + " did not come back within 1 s");
}

}  // namespace

std::string MulticastProblem(const std::string& url) {
  const LcmUrl parsed = ParseLcmUrl(url);
  if (!parsed.problem.empty()) return "the LCM URL '" + url + "' " + parsed.problem;
  return parsed.in_process ? "" : ProbeGroup(parsed);
}

}  // namespace axlecast
