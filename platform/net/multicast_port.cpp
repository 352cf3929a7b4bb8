#include "platform/net/multicast_port.h"

#include <arpa/inet.h>
#include <linux/filter.h>
#include <linux/if_packet.h>
#include <linux/sock_diag.h>
#include <net/if_arp.h>
#include <netinet/in.h>
#include <poll.h>
#include <sys/random.h>
#include <sys/socket.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstring>
#include <ctime>
#include <vector>

#include "platform/os/system_clock.h"

namespace axlecast {
namespace {

constexpr std::size_t kLargestDatagram = 65'536;  // above UDP's own limit of 65,507 bytes
constexpr std::size_t kControlSize = 128;

std::string Failed(const std::string& action) { return action + ": " + std::strerror(errno); }

template <typename T>
bool SetOption(int fd, int level, int name, const T& value) {
  return setsockopt(fd, level, name, &value, sizeof value) == 0;
}

// Returns the timestamp of the kernel, UNIX time in us. Every datagram has one, because SO_TIMESTAMPNS is set.
std::int64_t StampOf(msghdr& message) {
  for (cmsghdr* part = CMSG_FIRSTHDR(&message); part != nullptr; part = CMSG_NXTHDR(&message, part)) {
    if (part->cmsg_level != SOL_SOCKET || part->cmsg_type != SCM_TIMESTAMPNS) continue;
    timespec stamp{};
    std::memcpy(&stamp, CMSG_DATA(part), sizeof stamp);
    return std::int64_t{stamp.tv_sec} * 1'000'000 + stamp.tv_nsec / 1'000;
  }
  return 0;
}

// Truncates datagrams of other hosts to no bytes. If the route of the group leads to a network, the kernel marks looped-back
// copies (PACKET_LOOPBACK). If it leads to lo, no other host can reach the interface. The checksum was verified before.
bool TakeOnlyOwnHost(int fd) {
  constexpr std::uint32_t kUdpHeader = 8;  // what remains of other datagrams
  constexpr auto kExtra = static_cast<std::uint32_t>(SKF_AD_OFF);
  std::array<sock_filter, 6> steps = {{BPF_STMT(BPF_LD | BPF_W | BPF_ABS, kExtra + SKF_AD_PKTTYPE),
                                       BPF_JUMP(BPF_JMP | BPF_JEQ | BPF_K, PACKET_LOOPBACK, 2, 0),
                                       BPF_STMT(BPF_LD | BPF_W | BPF_ABS, kExtra + SKF_AD_HATYPE),
                                       BPF_JUMP(BPF_JMP | BPF_JEQ | BPF_K, ARPHRD_LOOPBACK, 0, 1),
                                       BPF_STMT(BPF_RET | BPF_K, 0xFFFFFFFF),
                                       BPF_STMT(BPF_RET | BPF_K, kUdpHeader)}};
  const sock_fprog program{steps.size(), steps.data()};
  return SetOption(fd, SOL_SOCKET, SO_ATTACH_FILTER, program);
}

constexpr MonoNs kProbeTime = kSecond;
constexpr std::size_t kTokenAt = 22;  // in a self test: behind header, channel and NUL

std::string MulticastRemedy(const std::string& cause) {
  return "multicast on this host is not usable: " + cause +
         "\nFix it (as root), for LCM within this host:\n"
         "  ip link set lo up multicast on\n"
         "  ip route add 224.0.0.0/4 dev lo\n"
         "A firewall must let the group's UDP port pass.";
}

std::string SystemProblem(const char* action) { return MulticastRemedy(Failed(action)); }

using SelfTestDatagram = std::array<std::uint8_t, 30>;

// Every LCM process sends this to itself when it first subscribes. Other processes ignore it.
SelfTestDatagram SelfTest() {
  SelfTestDatagram datagram{'L', 'C', '0', '2', 0, 0, 0, 0};  // short header, sequence number 0
  std::memcpy(datagram.data() + 8, "LCM_SELF_TEST", 14);
  if (getrandom(datagram.data() + kTokenAt, 8, 0) != 8) datagram[kTokenAt] = 1;
  return datagram;
}

sockaddr_in GroupOf(const LcmUrl& url) {
  sockaddr_in group{};
  group.sin_family = AF_INET;
  group.sin_port = htons(static_cast<std::uint16_t>(url.port));
  inet_pton(AF_INET, url.group.c_str(), &group.sin_addr);
  return group;
}

// Joins the group like any LCM process. Binds last: otherwise the port could receive one or two messages before it is set up,
// and then none until it has joined.
Result<> JoinGroup(int receiver, const LcmUrl& url) {
  const int on = 1;
  const int off = 0;
  const sockaddr_in group = GroupOf(url);
  ip_mreq membership{};
  membership.imr_multiaddr = group.sin_addr;
  if (!SetOption(receiver, SOL_SOCKET, SO_REUSEADDR, on)) return Failure(SystemProblem("SO_REUSEADDR"));
  if (!SetOption(receiver, IPPROTO_IP, IP_MULTICAST_ALL, off) ||
      !SetOption(receiver, IPPROTO_IP, IP_ADD_MEMBERSHIP, membership)) {
    return Failure(SystemProblem("joining the group"));
  }
  if (bind(receiver, reinterpret_cast<const sockaddr*>(&group), sizeof group) == 0) return {};
  return Failure(std::string("the port of LCM cannot be used: ") + std::strerror(errno) +
                 "; another program holds it without sharing (ss -ulpn shows which)");
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
  static_cast<void>(SetOption(receiver, SOL_SOCKET, SO_ATTACH_FILTER, program));
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

Result<> ProbeGroup(const LcmUrl& url) {
  const sockaddr_in group = GroupOf(url);
  const Descriptor receiver(socket(AF_INET, SOCK_DGRAM | SOCK_CLOEXEC, 0));
  const Descriptor sender(socket(AF_INET, SOCK_DGRAM | SOCK_CLOEXEC, 0));
  if (!receiver.valid() || !sender.valid()) return Failure(SystemProblem("opening a socket"));
  const SelfTestDatagram datagram = SelfTest();
  TakeOnly(receiver.get(), datagram);
  if (Result<> done = JoinGroup(receiver.get(), url); !done) return done;
  const auto ttl = static_cast<unsigned char>(url.ttl);
  if (!SetOption(sender.get(), IPPROTO_IP, IP_MULTICAST_TTL, ttl)) {
    return Failure(SystemProblem("IP_MULTICAST_TTL"));
  }
  if (sendto(sender.get(), datagram.data(), datagram.size(), 0, reinterpret_cast<const sockaddr*>(&group),
             sizeof group) < 0) {
    return Failure(SystemProblem("sending to the group"));
  }
  if (Arrives(receiver.get(), datagram)) return {};
  return Failure(MulticastRemedy("a datagram to " + url.group + " did not come back within 1 s"));
}

}  // namespace

struct MulticastPort::Buffers {
  explicit Buffers(std::size_t count)
      : bytes(std::make_unique_for_overwrite<std::uint8_t[]>(count * kLargestDatagram)),
        places(count),
        senders(count),
        control(count),
        messages(count),
        received(count) {
    for (std::size_t i = 0; i < count; ++i) {
      places[i] = {bytes.get() + i * kLargestDatagram, kLargestDatagram};
      msghdr& header = messages[i].msg_hdr;
      header.msg_iov = &places[i];
      header.msg_iovlen = 1;
      header.msg_name = &senders[i];
      header.msg_control = control[i].bytes.data();
    }
  }

  struct Control {
    alignas(cmsghdr) std::array<std::uint8_t, kControlSize> bytes;
  };

  std::unique_ptr<std::uint8_t[]> bytes;  // not cleared: unused parts take no memory
  std::vector<iovec> places;
  std::vector<sockaddr_in> senders;
  std::vector<Control> control;
  std::vector<mmsghdr> messages;
  std::vector<Received> received;
};

MulticastPort::MulticastPort(const LcmUrl& url)
    : socket_(socket(AF_INET, SOCK_DGRAM | SOCK_CLOEXEC | SOCK_NONBLOCK, 0)),
      buffers_(std::make_unique<Buffers>(kMaxPerRead)),
      own_host_only_(url.ttl == 0) {
  if (!socket_.valid()) {
    problem_ = Failed("no UDP socket can be made");
    return;
  }
  SetBuffer(url.recv_buf_size > 0 ? url.recv_buf_size : kDefaultBuffer);
  const int on = 1;
  if (!SetOption(socket_.get(), SOL_SOCKET, SO_TIMESTAMPNS, on) ||
      (own_host_only_ && !TakeOnlyOwnHost(socket_.get()))) {
    problem_ = Failed("a socket option of LCM's port cannot be set");
    return;
  }
  problem_ = ErrorText(JoinGroup(socket_.get(), url));
}

MulticastPort::~MulticastPort() = default;
MulticastPort::MulticastPort(MulticastPort&&) noexcept = default;
MulticastPort& MulticastPort::operator=(MulticastPort&&) noexcept = default;

void MulticastPort::SetBuffer(std::int64_t bytes) {
  const int wanted = static_cast<int>(bytes);
  if (SetOption(socket_.get(), SOL_SOCKET, SO_RCVBUFFORCE, wanted)) return;
  static_cast<void>(SetOption(socket_.get(), SOL_SOCKET, SO_RCVBUF, wanted));
  int given = 0;
  socklen_t size = sizeof given;
  static_cast<void>(getsockopt(socket_.get(), SOL_SOCKET, SO_RCVBUF, &given, &size));
  given /= 2;  // the kernel doubles what it was asked for (socket(7))
  if (given >= wanted) return;
  warning_ =
      "the kernel buffers " + std::to_string(given) + " bytes of this port instead of " + std::to_string(wanted) +
      ": bursts may be lost (and are counted). As root: sysctl -w net.core.rmem_max=" + std::to_string(wanted) +
      ", or give this program CAP_NET_ADMIN";
}

std::span<const MulticastPort::Received> MulticastPort::Read() {
  for (mmsghdr& message : buffers_->messages) {
    message.msg_hdr.msg_namelen = sizeof(sockaddr_in);
    message.msg_hdr.msg_controllen = kControlSize;
  }
  const int count = recvmmsg(socket_.get(), buffers_->messages.data(),
                             static_cast<unsigned>(buffers_->messages.size()), MSG_DONTWAIT, nullptr);
  const auto read = static_cast<std::size_t>(std::max(count, 0));
  for (std::size_t i = 0; i < read; ++i) {
    mmsghdr& message = buffers_->messages[i];
    const sockaddr_in& from = buffers_->senders[i];
    const auto* bytes = static_cast<const std::uint8_t*>(buffers_->places[i].iov_base);
    buffers_->received[i] = {{ntohl(from.sin_addr.s_addr), ntohs(from.sin_port)},
                             StampOf(message.msg_hdr),
                             Bytes(bytes, message.msg_len)};
    if (own_host_only_ && message.msg_len == 0) ++outside_;
  }
  return std::span(buffers_->received).first(read);
}

// SO_RXQ_OVFL reports the counter only with a later datagram, and thus never for the last ones.
std::int64_t MulticastPort::Dropped() {
  std::array<std::uint32_t, SK_MEMINFO_VARS> memory{};
  socklen_t size = sizeof memory;
  if (getsockopt(socket_.get(), SOL_SOCKET, SO_MEMINFO, memory.data(), &size) == 0) {
    dropped_ += memory[SK_MEMINFO_DROPS] - drop_counter_;
    drop_counter_ = memory[SK_MEMINFO_DROPS];
  }
  return dropped_;
}

Result<> CheckMulticast(const std::string& url) {
  const auto parsed = ParseLcmUrl(url);
  if (!parsed) return Failure("the LCM URL '" + url + "' " + parsed.error().text);
  if (parsed->in_process) return {};
  return ProbeGroup(*parsed);
}

}  // namespace axlecast
