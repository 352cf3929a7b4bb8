// Differential test: the same datagrams to LcmReceiver and to liblcm's receiver, in a network namespace of its own.
//
// Usage: udpm_streams STREAMS [SEED]; prints figures; exit 1 at the first stream of which a receiver makes something else than was
// sent. Both receivers must pass on the same messages in the same order.
//
// A round is as many streams as liblcm's socket buffer surely holds, and a last message "END". The next round begins when both
// receivers have passed END on, so that nothing is ever lost, and nothing that is late or too much remains unnoticed. LcmReceiver drops
// a message that is incomplete for 2 s: a round that took longer on a busy host is repeated with other streams, and counted.

#include <arpa/inet.h>
#include <lcm/lcm.h>
#include <netinet/in.h>
#include <poll.h>
#include <sys/socket.h>

#include <algorithm>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <memory>
#include <stdexcept>
#include <string>
#include <vector>

#include "core/messages/lcm_url.h"
#include "platform/net/group_sender.h"
#include "platform/net/lcm_receiver.h"
#include "platform/os/descriptor.h"
#include "platform/os/system_clock.h"
#include "tests/differential/random_streams.h"

namespace axlecast {
namespace {

constexpr const char* kGroup = "239.255.76.67";
constexpr std::uint16_t kPort = 7'667;
constexpr const char* kUrl = "udpm://239.255.76.67:7667?ttl=0&recv_buf_size=212992";
// A datagram takes at most this memory of a receiver's buffer, beside its bytes. The kernel gives twice the 212,992 bytes.
constexpr std::size_t kDatagramCost = 1'300;
constexpr std::size_t kRoundCost = 150'000;
constexpr std::size_t kRoundStreams = 64;
constexpr int kWaitMs = 20'000;  // for what is already in the buffer

void Check(bool good, const char* what) {
  if (!good) throw std::runtime_error(what);
}

sockaddr_in Address(const std::string& text, std::uint16_t port) {
  sockaddr_in address{};
  address.sin_family = AF_INET;
  address.sin_port = htons(port);
  Check(inet_pton(AF_INET, text.c_str(), &address.sin_addr) == 1, "an address");
  return address;
}

const sockaddr* Generic(const sockaddr_in& address) { return reinterpret_cast<const sockaddr*>(&address); }

// Sockets that differ in their address, their port, or both.
class Senders {
 public:
  Senders() {
    for (std::size_t i = 0; i < RandomStreams::kSenders; ++i) {
      Descriptor socket(::socket(AF_INET, SOCK_DGRAM, 0));
      const sockaddr_in own =
          Address("127.0.0." + std::to_string(1 + i / 2), static_cast<std::uint16_t>(40'000 + i % 2));
      Check(bind(socket.get(), Generic(own), sizeof own) == 0, "bind: is this a network namespace of its own?");
      const unsigned char ttl = 0;
      Check(setsockopt(socket.get(), IPPROTO_IP, IP_MULTICAST_TTL, &ttl, sizeof ttl) == 0, "IP_MULTICAST_TTL");
      sockets_.push_back(std::move(socket));
    }
  }

  void Send(std::size_t sender, const std::string& datagram) const {
    const ssize_t sent =
        sendto(sockets_[sender].get(), datagram.data(), datagram.size(), 0, Generic(group_), sizeof group_);
    Check(sent == static_cast<ssize_t>(datagram.size()), "sendto: no multicast on lo?");
  }

 private:
  const sockaddr_in group_ = Address(kGroup, kPort);
  std::vector<Descriptor> sockets_;
};

bool IsSelfTest(std::string_view channel) { return channel == "LCM_SELF_TEST"; }

// What one receiver has passed on in this round.
struct Passed {
  std::vector<LcmMessage> messages;
  bool ended = false;

  void Add(std::string_view channel, std::string_view data) {
    if (channel == kEndChannel) {
      ended = true;
    } else if (!IsSelfTest(channel)) {
      messages.push_back({std::string(channel), std::string(data)});
    }
  }
};

class Ours {
 public:
  explicit Ours(const LcmUrl& url) : receiver_(url) {
    Check(receiver_.problem().empty(), receiver_.problem().c_str());
  }

  Passed Read() {
    Passed passed;
    pollfd wait{receiver_.FileDescriptor(), POLLIN, 0};
    while (!passed.ended && poll(&wait, 1, kWaitMs) == 1) {
      receiver_.Read([&passed](std::string_view channel, Bytes data) {
        passed.Add(channel, {reinterpret_cast<const char*>(data.data()), data.size()});
      });
    }
    return passed;
  }

 private:
  LcmReceiver receiver_;
};

using Liblcm = std::unique_ptr<lcm_t, decltype(&lcm_destroy)>;

Liblcm OpenLiblcm() {
  Liblcm lcm(lcm_create(kUrl), lcm_destroy);
  Check(lcm != nullptr, "lcm_create");
  return lcm;
}

class Theirs {
 public:
  Theirs() {
    // (?s): "." is also a line feed.
    lcm_subscription_t* all = lcm_subscribe(lcm_.get(), "(?s).*", &Theirs::On, this);
    Check(all != nullptr, "lcm_subscribe");
    lcm_subscription_set_queue_capacity(all, 0);  // without a limit
  }

  Passed Read() {
    passed_ = {};
    while (!passed_.ended && lcm_handle_timeout(lcm_.get(), kWaitMs) > 0) {
    }
    return std::move(passed_);
  }

 private:
  static void On(const lcm_recv_buf_t* message, const char* channel, void* self) {
    static_cast<Theirs*>(self)->passed_.Add(channel, {static_cast<const char*>(message->data), message->data_size});
  }

  const Liblcm lcm_ = OpenLiblcm();
  Passed passed_;
};

std::string Printed(const LcmMessage* message) {
  if (message == nullptr) return "nothing";
  std::string text = "\"";
  for (const char byte : message->channel) {
    char hex[5] = {byte, '\0'};
    if (byte < ' ' || byte > '~') std::snprintf(hex, sizeof hex, "\\x%02x", static_cast<unsigned char>(byte));
    text += hex;
  }
  return text + "\" with " + std::to_string(message->data.size()) + " bytes";
}

// Prints the first difference.
bool IsEqual(const char* receiver, const Passed& passed, const std::vector<LcmMessage>& sent) {
  if (!passed.ended) std::printf("%s did not receive the END of the round\n", receiver);
  for (std::size_t i = 0; i < std::max(passed.messages.size(), sent.size()); ++i) {
    const LcmMessage* got = i < passed.messages.size() ? &passed.messages[i] : nullptr;
    const LcmMessage* expected = i < sent.size() ? &sent[i] : nullptr;
    if (got != nullptr && expected != nullptr && *got == *expected) continue;
    std::printf(
        "%s: message %zu of %zu is %s, not %s%s\n", receiver, i, sent.size(), Printed(got).c_str(),
        Printed(expected).c_str(),
        got != nullptr && expected != nullptr && got->data.size() == expected->data.size() ? " (other bytes)" : "");
    return false;
  }
  return passed.ended;
}

struct Tally {
  std::size_t streams = 0, rounds = 0, slow = 0, datagrams = 0, messages = 0, fragmented = 0, refused = 0,
              published = 0;
};

class Comparison {
 public:
  explicit Comparison(std::uint32_t seed)
      : streams_(seed), url_(ParseLcmUrl(kUrl).value()), ours_(url_), own_sender_(url_) {}

  // Returns false at a difference.
  bool Run(std::size_t streams) {
    while (tally_.streams < streams) {
      if (!Round(streams - tally_.streams)) {
        std::printf("in the round that ends with stream %zu\n", tally_.streams);
        return false;
      }
    }
    return true;
  }

  [[nodiscard]] const Tally& tally() const { return tally_; }

 private:
  bool Round(std::size_t most) {
    const MonoNs begin = clock_.Now();
    const Tally before = tally_;
    std::vector<LcmMessage> sent;
    std::size_t cost = 0;
    for (std::size_t i = 0; i < std::min(most, kRoundStreams) && cost < kRoundCost; ++i) {
      LcmStream stream = streams_.Next();
      for (const SenderStep& step : stream.steps) cost += Send(step);
      for (LcmMessage& message : stream.messages) sent.push_back(std::move(message));
      ++tally_.streams;
      tally_.fragmented += stream.fragmented;
      tally_.refused += stream.refused;
    }
    senders_.Send(0, EndDatagram(static_cast<std::uint32_t>(++tally_.rounds)));
    tally_.messages += sent.size();
    const Passed ours = ours_.Read();
    const bool slow = clock_.Now() - begin > FragmentStore::kAge;
    const Passed theirs = theirs_.Read();
    if (slow && ours.ended && theirs.ended) {
      tally_ = before;
      ++tally_.rounds;
      ++tally_.slow;
      return true;
    }
    const bool equal = IsEqual("LcmReceiver", ours, sent);
    return IsEqual("liblcm", theirs, sent) && equal;
  }

  // Returns what it costs.
  std::size_t Send(const SenderStep& step) {
    if (step.kind == SenderStep::Kind::kDatagram) {
      senders_.Send(step.sender, step.datagram);
      ++tally_.datagrams;
      return kDatagramCost + step.datagram.size();
    }
    ++tally_.published;
    const std::string& data = step.message.data;
    if (step.kind == SenderStep::Kind::kLiblcm) {
      Check(lcm_publish(publisher_.get(), step.message.channel.c_str(), data.data(),
                        static_cast<unsigned>(data.size())) == 0,
            "lcm_publish");
    } else {
      Check(
          own_sender_.Send(step.message.channel, {reinterpret_cast<const std::uint8_t*>(data.data()), data.size()}),
          "GroupSender");
    }
    return data.size() > 60'000 ? kRoundCost : kDatagramCost + data.size();
  }

  const SystemClock clock_;
  RandomStreams streams_;
  const LcmUrl url_;
  Ours ours_;
  Theirs theirs_;
  Senders senders_;
  const Liblcm publisher_ = OpenLiblcm();
  GroupSender own_sender_;
  Tally tally_;
};

int Main(int argc, char** argv) {
  const long streams = argc > 1 ? std::atol(argv[1]) : 0;
  if (streams <= 0) {
    std::fprintf(stderr, "usage: udpm_streams STREAMS [SEED]\n");
    return 2;
  }
  const auto seed = static_cast<std::uint32_t>(argc > 2 ? std::atol(argv[2]) : 1);
  Comparison comparison(seed);
  const bool equal = comparison.Run(static_cast<std::size_t>(streams));
  const Tally& tally = comparison.tally();
  std::printf(
      "seed %u: %zu streams, %zu messages, %zu of them in fragments, %zu published by liblcm or GroupSender, %zu "
      "datagrams "
      "beside, %zu that no message must come of; %zu of %zu rounds were too slow\n%s\n",
      seed, tally.streams, tally.messages, tally.fragmented, tally.published, tally.datagrams, tally.refused,
      tally.slow, tally.rounds,
      equal ? "LcmReceiver and liblcm passed on the same messages in the same order" : "FAILED");
  return equal ? 0 : 1;
}

}  // namespace
}  // namespace axlecast

int main(int argc, char** argv) {
  try {
    return axlecast::Main(argc, argv);
  } catch (const std::exception& error) {
    std::fprintf(stderr, "udpm_streams: %s\n", error.what());
    return 1;
  }
}
