// Receives a replay: when each message was sent, against when it was due.
//
// replay_ear GROUP PORT
//
// Prints "ready"; at SIGTERM prints one JSON object. The first 8 bytes of a message's data are its time in the log, us,
// big-endian. The instant is the kernel's, which on loopback is within the sender's own call: how the receiver is scheduled
// plays no part. A sender's origin is unknown: lateness is measured against its most punctual message. `first_ns`:
// CLOCK_REALTIME of the first message.

#include <arpa/inet.h>
#include <netinet/in.h>
#include <poll.h>
#include <sys/socket.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <csignal>
#include <cstdlib>
#include <cstring>
#include <iterator>
#include <vector>

#include "bench/distribution.h"

namespace axlecast::bench {
namespace {

constexpr std::size_t kHeader = 8;  // of LCM's short message: magic, sequence
volatile std::sig_atomic_t stopped = 0;

struct Heard {
  std::int64_t planned;  // ns
  std::int64_t sent;     // ns, CLOCK_REALTIME
};

int Open(const char* group, int port) {
  const int ear = socket(AF_INET, SOCK_DGRAM, 0);
  const int on = 1;
  const int size = 256 << 20;
  setsockopt(ear, SOL_SOCKET, SO_REUSEADDR, &on, sizeof on);
  setsockopt(ear, SOL_SOCKET, SO_TIMESTAMPNS, &on, sizeof on);
  setsockopt(ear, SOL_SOCKET, SO_RCVBUFFORCE, &size, sizeof size);
  sockaddr_in address{};
  address.sin_family = AF_INET;
  address.sin_port = htons(static_cast<std::uint16_t>(port));
  ip_mreq membership{};
  inet_pton(AF_INET, group, &membership.imr_multiaddr);
  if (bind(ear, reinterpret_cast<sockaddr*>(&address), sizeof address) != 0 ||
      setsockopt(ear, IPPROTO_IP, IP_ADD_MEMBERSHIP, &membership, sizeof membership) != 0) {
    std::perror("replay_ear");
    std::exit(1);
  }
  return ear;
}

// The message's time; negative if the datagram is not from the log.
std::int64_t PlannedUs(const std::uint8_t* datagram, std::size_t size) {
  if (size < kHeader) return -1;
  const void* end = std::memchr(datagram + kHeader, 0, size - kHeader);
  if (end == nullptr || std::memcmp(datagram + kHeader, "LCM_SELF_TEST", 13) == 0) return -1;
  const auto* data = static_cast<const std::uint8_t*>(end) + 1;
  if (datagram + size - data < 8) return -1;
  std::int64_t planned = 0;
  for (int i = 0; i < 8; ++i) planned = planned << 8 | data[i];
  return planned;
}

bool Hear(int ear, std::vector<Heard>& heard) {
  std::array<std::uint8_t, 65'536> datagram;
  std::array<std::uint8_t, 128> control;
  iovec part{datagram.data(), datagram.size()};
  msghdr message{};
  message.msg_iov = &part;
  message.msg_iovlen = 1;
  message.msg_control = control.data();
  message.msg_controllen = control.size();
  const ssize_t size = recvmsg(ear, &message, MSG_DONTWAIT);
  if (size < 0) return false;
  const std::int64_t planned = PlannedUs(datagram.data(), static_cast<std::size_t>(size));
  const cmsghdr* header = CMSG_FIRSTHDR(&message);
  if (planned < 0 || header == nullptr || header->cmsg_type != SO_TIMESTAMPNS) return true;
  timespec sent{};
  std::memcpy(&sent, CMSG_DATA(header), sizeof sent);
  heard.push_back({planned * 1'000, sent.tv_sec * INT64_C(1'000'000'000) + sent.tv_nsec});
  return true;
}

void Print(const std::vector<Heard>& heard) {
  std::vector<std::int64_t> late;
  std::transform(heard.begin(), heard.end(), std::back_inserter(late),
                 [](const Heard& one) { return one.sent - one.planned; });
  const std::int64_t origin = late.empty() ? 0 : *std::min_element(late.begin(), late.end());
  for (std::int64_t& one : late) one -= origin;
  const double span = heard.empty() ? 0 : static_cast<double>(heard.back().sent - heard.front().sent) * 1e-9;
  const long long first = heard.empty() ? 0 : static_cast<long long>(heard.front().sent);
  std::printf("{\"messages\": %zu, \"seconds\": %.9f, \"first_ns\": %lld, ", heard.size(), span, first);
  PrintDistribution("late", late);
  std::printf("}\n");
}

int Main(int argc, char** argv) {
  if (argc != 3) {
    std::fprintf(stderr, "usage: replay_ear GROUP PORT\n");
    return 2;
  }
  struct sigaction stop {};
  stop.sa_handler = [](int) { stopped = 1; };
  sigaction(SIGTERM, &stop, nullptr);
  const int ear = Open(argv[1], std::atoi(argv[2]));
  std::vector<Heard> heard;
  heard.reserve(2'000'000);
  std::printf("ready\n");
  std::fflush(stdout);
  while (stopped == 0) {
    pollfd readable{ear, POLLIN, 0};
    poll(&readable, 1, 20);
    while (Hear(ear, heard)) continue;
  }
  while (Hear(ear, heard)) continue;
  close(ear);
  Print(heard);
  return 0;
}

}  // namespace
}  // namespace axlecast::bench

int main(int argc, char** argv) { return axlecast::bench::Main(argc, argv); }
