#include "platform/net/multicast_port.h"

#include <linux/filter.h>
#include <linux/if_packet.h>
#include <linux/sock_diag.h>
#include <net/if_arp.h>
#include <netinet/in.h>
#include <sys/epoll.h>
#include <sys/socket.h>
#include <sys/timerfd.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstring>
#include <ctime>
#include <vector>

namespace axlecast {
namespace {

constexpr std::size_t kLargestDatagram = 65'536;  // above UDP's own limit of 65,507 bytes
constexpr std::size_t kControlSize = 128;
constexpr MonoNs kLookInterval = 400 * kMillisecond;  // less than that of the timer

std::string Failed(const std::string& action) { return action + ": " + std::strerror(errno); }

// What the kernel adds to a datagram.
struct Control {
  std::int64_t utime = 0;  // us, UNIX time; every datagram has one, because SO_TIMESTAMPNS is set
  unsigned interface = 0;  // of the arrival, IPv6 only
};

Control ControlOf(msghdr& message) {
  Control control;
  for (cmsghdr* part = CMSG_FIRSTHDR(&message); part != nullptr; part = CMSG_NXTHDR(&message, part)) {
    if (part->cmsg_level == SOL_SOCKET && part->cmsg_type == SCM_TIMESTAMPNS) {
      timespec stamp{};
      std::memcpy(&stamp, CMSG_DATA(part), sizeof stamp);
      control.utime = std::int64_t{stamp.tv_sec} * 1'000'000 + stamp.tv_nsec / 1'000;
    } else if (part->cmsg_level == IPPROTO_IPV6 && part->cmsg_type == IPV6_PKTINFO) {
      in6_pktinfo information{};
      std::memcpy(&information, CMSG_DATA(part), sizeof information);
      control.interface = information.ipi6_ifindex;
    }
  }
  return control;
}

SenderAddress SenderOf(const sockaddr_storage& from) {
  if (from.ss_family == AF_INET6) {
    const auto& address = reinterpret_cast<const sockaddr_in6&>(from);
    SenderAddress sender{.address = {}, .port = ntohs(address.sin6_port)};
    std::memcpy(sender.address.data(), &address.sin6_addr, sender.address.size());
    return sender;
  }
  const auto& address = reinterpret_cast<const sockaddr_in&>(from);
  return SenderAddress::OfIPv4(ntohl(address.sin_addr.s_addr), ntohs(address.sin_port));
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

  struct Space {
    alignas(cmsghdr) std::array<std::uint8_t, kControlSize> bytes;
  };

  std::unique_ptr<std::uint8_t[]> bytes;  // not cleared: unused parts take no memory
  std::vector<iovec> places;
  std::vector<sockaddr_storage> senders;
  std::vector<Space> control;
  std::vector<mmsghdr> messages;
  std::vector<Received> received;
};

MulticastPort::MulticastPort(const LcmUrl& url)
    : group_(url),
      socket_(OpenGroupSocket(group_, SOCK_NONBLOCK)),
      buffers_(std::make_unique<Buffers>(kMaxPerRead)),
      own_host_only_(url.ttl == 0) {
  if (!socket_.valid()) {
    problem_ = Failed("no UDP socket can be made");
    return;
  }
  SetBuffer(url.recv_buf_size > 0 ? url.recv_buf_size : kDefaultBuffer);
  const int on = 1;
  if (!SetOption(socket_.get(), SOL_SOCKET, SO_TIMESTAMPNS, on) ||
      (url.IsIPv6() && !SetOption(socket_.get(), IPPROTO_IPV6, IPV6_RECVPKTINFO, on)) ||
      (own_host_only_ && !TakeOnlyOwnHost(socket_.get())) || (!url.interface.empty() && !OpenTimer())) {
    problem_ = Failed("a socket option of LCM's port cannot be set");
    return;
  }
  if (!url.interface.empty()) {
    watch_.emplace(url);
    Follow();
  } else if (!JoinGroup(socket_.get(), group_, 0)) {
    problem_ = Failed("the multicast group " + url.group + " cannot be joined");
    return;
  }
  problem_ = ErrorText(BindToGroup(socket_.get(), group_));
}

bool MulticastPort::OpenTimer() {
  timer_ = Descriptor(timerfd_create(CLOCK_MONOTONIC, TFD_CLOEXEC | TFD_NONBLOCK));
  wake_ = Descriptor(epoll_create1(EPOLL_CLOEXEC));
  if (!timer_.valid() || !wake_.valid()) return false;
  return std::ranges::all_of(std::array{timer_.get(), socket_.get()}, [this](int file) {
    epoll_event readable{};
    readable.events = EPOLLIN;
    return epoll_ctl(wake_.get(), EPOLL_CTL_ADD, file, &readable) == 0;
  });
}

// The membership of a deleted interface is left as well: its number could come back. The timer is set again at each look, so that
// it is never readable before the next one is due.
void MulticastPort::Follow() {
  constexpr itimerspec kWakeAfter{{0, 0}, {0, 500'000'000}};
  static_assert(kLookInterval < 500 * kMillisecond);
  const MonoNs now = clock_.Now();
  if (now < next_look_) return;
  next_look_ = now + kLookInterval;
  static_cast<void>(timerfd_settime(timer_.get(), 0, &kWakeAfter, nullptr));
  watch_->Update();
  network_problem_ = watch_->problem();
  if (watch_->index() == joined_) return;
  if (joined_ != 0) LeaveGroup(socket_.get(), group_, joined_);
  joined_ = watch_->index();
  if (joined_ == 0 || JoinGroup(socket_.get(), group_, joined_)) return;
  joined_ = 0;
  if (network_problem_.empty()) network_problem_ = Failed("the multicast group cannot be joined on the interface");
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
  if (watch_) Follow();
  for (mmsghdr& message : buffers_->messages) {
    message.msg_hdr.msg_namelen = sizeof(sockaddr_storage);
    message.msg_hdr.msg_controllen = kControlSize;
  }
  const int count = recvmmsg(socket_.get(), buffers_->messages.data(),
                             static_cast<unsigned>(buffers_->messages.size()), MSG_DONTWAIT, nullptr);
  const auto read = static_cast<std::size_t>(std::max(count, 0));
  std::size_t taken = 0;
  for (std::size_t i = 0; i < read; ++i) {
    mmsghdr& message = buffers_->messages[i];
    const Control control = ControlOf(message.msg_hdr);
    // The kernel selects by the joined interface for IPv4 only.
    if (control.interface != 0 && control.interface != joined_) continue;
    const auto* bytes = static_cast<const std::uint8_t*>(buffers_->places[i].iov_base);
    buffers_->received[taken++] = {SenderOf(buffers_->senders[i]), control.utime, Bytes(bytes, message.msg_len)};
    if (own_host_only_ && message.msg_len == 0) ++outside_;
  }
  return std::span(buffers_->received).first(taken);
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

}  // namespace axlecast
