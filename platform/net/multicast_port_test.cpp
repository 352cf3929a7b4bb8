#include "platform/net/multicast_port.h"

#include <arpa/inet.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <netinet/in.h>
#include <poll.h>
#include <sys/socket.h>

#include <iterator>
#include <string>
#include <vector>

#include "platform/net/lcm_receiver.h"
#include "platform/os/system_clock.h"

namespace axlecast {
namespace {

using ::testing::HasSubstr;

constexpr const char* kGroup = "239.255.76.68";
constexpr std::uint16_t kPort = 7'668;

std::string Url(const std::string& options = "") {
  return std::string("udpm://") + kGroup + ':' + std::to_string(kPort) + "?ttl=0" + options;
}

class Sender {
 public:
  Sender() : socket_(socket(AF_INET, SOCK_DGRAM | SOCK_CLOEXEC, 0)) {
    const unsigned char ttl = 0;
    setsockopt(socket_.get(), IPPROTO_IP, IP_MULTICAST_TTL, &ttl, sizeof ttl);
  }
  [[nodiscard]] bool Send(const std::string& text, const char* group = kGroup) const {
    sockaddr_in address{};
    address.sin_family = AF_INET;
    address.sin_port = htons(kPort);
    inet_pton(AF_INET, group, &address.sin_addr);
    return sendto(socket_.get(), text.data(), text.size(), 0, reinterpret_cast<const sockaddr*>(&address),
                  sizeof address) == static_cast<ssize_t>(text.size());
  }
  [[nodiscard]] std::uint16_t port() const {
    sockaddr_in own{};
    socklen_t size = sizeof own;
    getsockname(socket_.get(), reinterpret_cast<sockaddr*>(&own), &size);
    return ntohs(own.sin_port);
  }

 private:
  Descriptor socket_;
};

constexpr MonoNs kLimit = 30 * kSecond;  // generous: for a host that is busy with something else

// What waits, until it and what was dropped are `count` datagrams.
std::vector<std::string> Take(MulticastPort& port, std::int64_t count,
                              std::vector<MulticastPort::Received>* details = nullptr) {
  const SystemClock clock;
  const MonoNs end = clock.Now() + kLimit;
  std::vector<std::string> taken;
  while (std::ssize(taken) + port.Dropped() < count && clock.Now() < end) {
    pollfd readable{port.FileDescriptor(), POLLIN, 0};
    static_cast<void>(poll(&readable, 1, 100));
    for (const MulticastPort::Received& received : port.Read()) {
      taken.emplace_back(received.bytes.begin(), received.bytes.end());
      if (details != nullptr) details->push_back(received);
    }
  }
  return taken;
}

TEST(MulticastPort, TellsSenderAndBytes) {
  MulticastPort port(*ParseLcmUrl(Url()));
  ASSERT_EQ(port.problem(), "");
  const Sender sender;
  ASSERT_TRUE(sender.Send("one"));
  ASSERT_TRUE(sender.Send(""));
  std::vector<MulticastPort::Received> details;
  EXPECT_EQ(Take(port, 2, &details), (std::vector<std::string>{"one", ""}));
  for (const MulticastPort::Received& received : details) EXPECT_EQ(received.sender.port, sender.port());
  EXPECT_EQ(port.Dropped(), 0);
}

// However late it is read. Not from the first datagram on: see Received::utime.
TEST(MulticastPort, TellsTheTimeAtWhichTheKernelReceived) {
  MulticastPort port(*ParseLcmUrl(Url()));
  const Sender sender;
  const SystemClock clock;
  const MonoNs end = clock.Now() + kLimit;
  bool stamped = false;
  while (!stamped && clock.Now() < end) {
    const std::int64_t before = clock.UtcMicroseconds();
    ASSERT_TRUE(sender.Send("one"));
    const std::int64_t after = clock.UtcMicroseconds();
    while (clock.UtcMicroseconds() < after + 1'000) {
    }
    std::vector<MulticastPort::Received> details;
    Take(port, 1, &details);
    ASSERT_EQ(details.size(), 1U);
    ASSERT_GE(details[0].utime, before - 1);
    stamped = details[0].utime <= after + 1;
  }
  EXPECT_TRUE(stamped);
}

TEST(MulticastPort, ReadsABurstWholeAndTheLargestDatagram) {
  MulticastPort port(*ParseLcmUrl(Url()));
  const Sender sender;
  std::vector<std::string> sent = {std::string(65'507, 'x')};
  for (int i = 0; i < 100; ++i) sent.push_back(std::to_string(i));
  for (const std::string& text : sent) ASSERT_TRUE(sender.Send(text));
  EXPECT_EQ(Take(port, std::ssize(sent)), sent);
}

// liblcm's sockets, bound to 0.0.0.0, take them: any host could reach a machine of ttl=0 past its group.
TEST(MulticastPort, WhatIsSentToThisHostsOwnAddressIsNotReceived) {
  MulticastPort port(*ParseLcmUrl(Url()));
  const Sender sender;
  ASSERT_TRUE(sender.Send("unicast", "127.0.0.1"));
  ASSERT_TRUE(sender.Send("group"));
  EXPECT_EQ(Take(port, 1), std::vector<std::string>{"group"});
  EXPECT_EQ(port.outside(), 0);
}

TEST(MulticastPort, AnotherGroupOnThePortIsNotHeard) {
  MulticastPort port(*ParseLcmUrl(Url()));
  MulticastPort other(*ParseLcmUrl("udpm://239.255.76.69:" + std::to_string(kPort)));
  ASSERT_EQ(other.problem(), "");
  const Sender sender;
  ASSERT_TRUE(sender.Send("theirs", "239.255.76.69"));
  ASSERT_TRUE(sender.Send("ours"));
  EXPECT_EQ(Take(port, 1), std::vector<std::string>{"ours"});
  EXPECT_EQ(Take(other, 1), std::vector<std::string>{"theirs"});
}

TEST(MulticastPort, CountsWhatTheKernelDroppedAlsoTheLastOnes) {
  MulticastPort port(*ParseLcmUrl(Url("&recv_buf_size=8192")));
  const Sender sender;
  constexpr std::int64_t kSent = 500;
  for (std::int64_t i = 0; i < kSent; ++i) ASSERT_TRUE(sender.Send(std::string(500, 'x')));
  const std::int64_t taken = std::ssize(Take(port, kSent));
  EXPECT_LT(taken, kSent);
  EXPECT_EQ(port.Dropped(), kSent - taken);
  EXPECT_EQ(port.Dropped(), kSent - taken);
}

TEST(MulticastPort, APortThatAnotherProgramHoldsIsAProblem) {
  const Descriptor holder(socket(AF_INET, SOCK_DGRAM | SOCK_CLOEXEC, 0));
  sockaddr_in any{};
  any.sin_family = AF_INET;
  any.sin_port = htons(7'669);
  ASSERT_EQ(bind(holder.get(), reinterpret_cast<const sockaddr*>(&any), sizeof any), 0);
  const MulticastPort port(*ParseLcmUrl("udpm://239.255.76.68:7669"));
  EXPECT_THAT(port.problem(), HasSubstr("another program holds it"));
}

// A short message of LCM's wire protocol.
std::string ShortMessage(const std::string& channel, const std::string& data) {
  return std::string("LC02\0\0\0\0", 8) + channel + '\0' + data;
}

// Reads until the receiver has counted so many messages, malformed datagrams and datagrams that the kernel dropped. Returns the number of
// datagrams that it has read.
std::size_t ReadUntil(LcmReceiver& receiver, std::int64_t count, std::vector<std::string>& channels) {
  const SystemClock clock;
  const MonoNs end = clock.Now() + kLimit;
  const auto counted = [&receiver] {
    const ReceptionCounts counts = receiver.counts();
    return counts.messages + counts.malformed + counts.dropped;
  };
  std::size_t datagrams = 0;
  while (counted() < count && clock.Now() < end) {
    pollfd readable{receiver.FileDescriptor(), POLLIN, 0};
    static_cast<void>(poll(&readable, 1, 10));
    datagrams += receiver.Read([&channels](std::string_view channel, Bytes) { channels.emplace_back(channel); });
  }
  return datagrams;
}

// Read ten times a second, as the receivers of this project do.
TEST(MulticastPort, AnInterfaceWakesItsUserAFewTimesASecondOnly) {
  MulticastPort port(*ParseLcmUrl(Url("&interface=lo")));
  ASSERT_EQ(port.problem(), "");
  const SystemClock clock;
  constexpr int kSeconds = 2;
  int woken = 0;
  for (const MonoNs end = clock.Now() + kSeconds * kSecond; clock.Now() < end;) {
    pollfd readable{port.FileDescriptor(), POLLIN, 0};
    woken += poll(&readable, 1, 100) > 0 ? 1 : 0;
    static_cast<void>(port.Read());
  }
  EXPECT_LE(woken, 4 * kSeconds);
}

TEST(LcmReceiverTest, CountsMessagesAndMalformedDatagrams) {
  LcmReceiver receiver(*ParseLcmUrl(Url()));
  const Sender sender;
  std::vector<std::string> channels;
  ASSERT_TRUE(sender.Send(ShortMessage("A", "1")));
  EXPECT_EQ(ReadUntil(receiver, 1, channels), 1);
  ASSERT_TRUE(sender.Send("no message"));
  ASSERT_TRUE(sender.Send(ShortMessage("B", "")));
  EXPECT_EQ(ReadUntil(receiver, 3, channels), 2);
  EXPECT_EQ(channels, (std::vector<std::string>{"A", "B"}));
  const ReceptionCounts counts = receiver.counts();
  EXPECT_EQ(counts.messages, 2);
  EXPECT_EQ(counts.malformed, 1);
  EXPECT_EQ(counts.dropped, 0);
  EXPECT_EQ(counts.outside, 0);
}

// Several times, because a host that is busy with something else may take 100 ms for one message, and then the counts are due anyway.
TEST(LcmReceiverTest, MessagesAreCountedOnceTheyWereRead) {
  LcmReceiver receiver(*ParseLcmUrl(Url()));
  const Sender sender;
  for (int count = 1; count <= 10; ++count) {
    ASSERT_TRUE(sender.Send(ShortMessage("A", "1")));
    pollfd readable{receiver.FileDescriptor(), POLLIN, 0};
    ASSERT_EQ(poll(&readable, 1, static_cast<int>(kLimit / kMillisecond)), 1);
    ASSERT_EQ(receiver.Read([](std::string_view, Bytes) {}), 1U);
    EXPECT_EQ(receiver.counts().messages, count);
  }
}

// The last burst is read before the counts are due again. Several times, as above.
TEST(LcmReceiverTest, CountsWhatTheKernelDroppedFromTheLastBurst) {
  LcmReceiver receiver(*ParseLcmUrl(Url("&recv_buf_size=8192")));
  const Sender sender;
  std::vector<std::string> channels;
  constexpr std::int64_t kBurst = 100;
  std::int64_t sent = 0;
  for (int round = 0; round < 5; ++round) {
    ASSERT_TRUE(sender.Send(ShortMessage("A", "1")));
    ReadUntil(receiver, ++sent, channels);
    for (std::int64_t i = 0; i < kBurst; ++i) ASSERT_TRUE(sender.Send(ShortMessage("A", std::string(500, 'x'))));
    sent += kBurst;
    ReadUntil(receiver, sent, channels);
    const ReceptionCounts counts = receiver.counts();
    ASSERT_EQ(counts.messages + counts.dropped, sent) << "round " << round;
  }
  EXPECT_GT(receiver.counts().dropped, 0);
}

TEST(LcmReceiverTest, CountsWhatTheKernelDroppedWhenNothingArrivesAnyMore) {
  LcmReceiver receiver(*ParseLcmUrl(Url("&recv_buf_size=8192")));
  const Sender sender;
  constexpr std::int64_t kSent = 500;
  for (std::int64_t i = 0; i < kSent; ++i) ASSERT_TRUE(sender.Send(ShortMessage("A", std::string(500, 'x'))));
  std::vector<std::string> channels;
  const auto taken = static_cast<std::int64_t>(ReadUntil(receiver, kSent, channels));
  EXPECT_LT(taken, kSent);
  EXPECT_EQ(receiver.counts().dropped, kSent - taken);
}

}  // namespace

}  // namespace axlecast
