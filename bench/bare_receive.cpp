// The peer of the recorder's costs: a bare receive loop. Counts datagrams and does nothing with them.
//
// bare_receive GROUP PORT BUFFER_BYTES
//
// At SIGTERM, when nothing waits any more, prints one JSON object: how many of the sender's messages came.

#include <arpa/inet.h>
#include <netinet/in.h>
#include <sys/socket.h>
#include <unistd.h>

#include <array>
#include <csignal>
#include <cstdint>
#include <cstdio>
#include <cstdlib>

namespace axlecast::bench {
namespace {

volatile std::sig_atomic_t stopped = 0;

int Open(const char* group, int port, int buffer) {
  const int ear = socket(AF_INET, SOCK_DGRAM, 0);
  const int on = 1;
  setsockopt(ear, SOL_SOCKET, SO_REUSEADDR, &on, sizeof on);
  if (setsockopt(ear, SOL_SOCKET, SO_RCVBUFFORCE, &buffer, sizeof buffer) != 0) {
    setsockopt(ear, SOL_SOCKET, SO_RCVBUF, &buffer, sizeof buffer);
  }
  // recv blocks for a limited time: a signal that comes just before it would not end it.
  const timeval longest{0, 100'000};
  setsockopt(ear, SOL_SOCKET, SO_RCVTIMEO, &longest, sizeof longest);
  sockaddr_in address{};
  address.sin_family = AF_INET;
  address.sin_port = htons(static_cast<std::uint16_t>(port));
  ip_mreq membership{};
  inet_pton(AF_INET, group, &membership.imr_multiaddr);
  if (bind(ear, reinterpret_cast<sockaddr*>(&address), sizeof address) != 0 ||
      setsockopt(ear, IPPROTO_IP, IP_ADD_MEMBERSHIP, &membership, sizeof membership) != 0) {
    std::perror("bare_receive");
    std::exit(1);
  }
  return ear;
}

int Main(int argc, char** argv) {
  if (argc != 4) {
    std::fprintf(stderr, "usage: bare_receive GROUP PORT BUFFER_BYTES\n");
    return 2;
  }
  struct sigaction stop {};
  stop.sa_handler = [](int) { stopped = 1; };
  sigaction(SIGTERM, &stop, nullptr);
  const int ear = Open(argv[1], std::atoi(argv[2]), std::atoi(argv[3]));
  std::array<std::uint8_t, 65'536> datagram;
  std::int64_t messages = 0;
  std::printf("ready\n");
  std::fflush(stdout);
  while (true) {
    const ssize_t size = recv(ear, datagram.data(), datagram.size(), 0);
    if (size > 0) ++messages;
    if (size < 0 && stopped != 0) break;
  }
  close(ear);
  std::printf("{\"messages\": %lld}\n", static_cast<long long>(messages));
  return 0;
}

}  // namespace
}  // namespace axlecast::bench

int main(int argc, char** argv) { return axlecast::bench::Main(argc, argv); }
