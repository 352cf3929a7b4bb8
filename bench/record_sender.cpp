// The load of a recording: numbered LCM messages from one sender, by the wire protocol itself, so that neither liblcm nor
// axlecast limits or colours it.
//
// record_sender GROUP PORT MESSAGES RATE BYTES
//
// RATE in messages a second, each in its own slot; those whose slots have passed go out in one call. 0: all as fast as
// possible. Prints its truth as one JSON object. The first 4 bytes of a message's data are its number, as in its header.

#include <arpa/inet.h>
#include <netinet/in.h>
#include <sys/prctl.h>
#include <sys/socket.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <vector>

#include "bench/monotonic.h"

namespace axlecast::bench {
namespace {

constexpr std::size_t kMaxPerCall = 64;
constexpr std::array<std::uint8_t, 4> kMagic = {'L', 'C', '0', '2'};  // of a short message
constexpr char kChannel[] = "LOAD";
constexpr std::size_t kNumberAt = 4;                  // in the header
constexpr std::size_t kDataAt = 8 + sizeof kChannel;  // behind magic, number, channel and its NUL
constexpr std::size_t kLargest = 65'499;              // bytes of data that fit a short message

struct Load {
  std::int64_t messages;
  double rate;  // 0: as fast as possible
  std::size_t bytes;
};

void PutNumber(std::uint8_t* bytes, std::int64_t number) {
  for (int i = 0; i < 4; ++i) bytes[i] = static_cast<std::uint8_t>(number >> (24 - 8 * i));
}

// Datagrams that are sent together.
class Batch {
 public:
  Batch(const sockaddr_in& address, std::size_t data_size) : address_(address) {
    for (std::size_t i = 0; i < kMaxPerCall; ++i) {
      std::vector<std::uint8_t>& datagram = datagrams_[i];
      datagram.resize(kDataAt + data_size, '.');
      std::memcpy(datagram.data(), kMagic.data(), kMagic.size());
      std::memcpy(datagram.data() + 8, kChannel, sizeof kChannel);
      parts_[i] = {datagram.data(), datagram.size()};
      messages_[i].msg_hdr.msg_name = &address_;
      messages_[i].msg_hdr.msg_namelen = sizeof address_;
      messages_[i].msg_hdr.msg_iov = &parts_[i];
      messages_[i].msg_hdr.msg_iovlen = 1;
    }
  }

  // Sends `count` messages, numbered from `first`: how many of them went; negative: an error.
  std::int64_t Send(int sender, std::int64_t first, std::int64_t count) {
    const auto size = std::min(static_cast<std::size_t>(count), kMaxPerCall);
    for (std::size_t i = 0; i < size; ++i) {
      PutNumber(datagrams_[i].data() + kNumberAt, first + static_cast<std::int64_t>(i));
      PutNumber(datagrams_[i].data() + kDataAt, first + static_cast<std::int64_t>(i));
    }
    const int sent = sendmmsg(sender, messages_.data(), static_cast<unsigned>(size), 0);
    return sent < 0 && errno == EINTR ? 0 : sent;
  }

 private:
  sockaddr_in address_;
  std::array<std::vector<std::uint8_t>, kMaxPerCall> datagrams_;
  std::array<iovec, kMaxPerCall> parts_{};
  std::array<mmsghdr, kMaxPerCall> messages_{};
};

// How many messages have been sent.
std::int64_t SendAll(int sender, Batch& batch, const Load& load) {
  const std::int64_t begin = MonotonicNow();
  std::int64_t sent = 0;
  while (sent < load.messages) {
    std::int64_t due = load.messages;
    if (load.rate > 0) {
      SleepUntil(begin + static_cast<std::int64_t>(static_cast<double>(sent) * 1e9 / load.rate));
      const double slots = static_cast<double>(MonotonicNow() - begin) * 1e-9 * load.rate;
      due = std::min(load.messages, static_cast<std::int64_t>(slots) + 1);
    }
    if (due <= sent) continue;
    const std::int64_t gone = batch.Send(sender, sent, due - sent);
    if (gone < 0) {
      std::perror("record_sender: sendmmsg");
      return sent;
    }
    sent += gone;
  }
  return sent;
}

int Main(int argc, char** argv) {
  if (argc != 6) {
    std::fprintf(stderr, "usage: record_sender GROUP PORT MESSAGES RATE BYTES\n");
    return 2;
  }
  sockaddr_in address{};
  address.sin_family = AF_INET;
  address.sin_port = htons(static_cast<std::uint16_t>(std::atoi(argv[2])));
  const Load load{std::atoll(argv[3]), std::atof(argv[4]), static_cast<std::size_t>(std::atoll(argv[5]))};
  if (inet_pton(AF_INET, argv[1], &address.sin_addr) != 1 || load.bytes < 4 || load.bytes > kLargest) return 2;
  const int sender = socket(AF_INET, SOCK_DGRAM, 0);
  const int ttl = 0;
  if (setsockopt(sender, IPPROTO_IP, IP_MULTICAST_TTL, &ttl, sizeof ttl) != 0) return 1;
  prctl(PR_SET_TIMERSLACK, 1UL);
  Batch batch(address, load.bytes);
  const std::int64_t begin = MonotonicNow();
  const std::int64_t sent = SendAll(sender, batch, load);
  const double seconds = static_cast<double>(MonotonicNow() - begin) * 1e-9;
  close(sender);
  std::printf("{\"sent\": %lld, \"first\": 0, \"last\": %lld, \"seconds\": %.6f}\n", static_cast<long long>(sent),
              static_cast<long long>(sent - 1), seconds);
  return sent == load.messages ? 0 : 1;
}

}  // namespace
}  // namespace axlecast::bench

int main(int argc, char** argv) { return axlecast::bench::Main(argc, argv); }
