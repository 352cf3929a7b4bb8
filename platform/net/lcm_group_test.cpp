// LcmPort over udpm://, in a network of the test's own that has multicast.
#include <arpa/inet.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <netinet/in.h>
#include <poll.h>
#include <sys/socket.h>

#include <array>
#include <axlecast/bus_health_t.hpp>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <string>
#include <utility>
#include <vector>

#include "core/messages/origin.h"
#include "platform/net/datagram_test_support.h"
#include "platform/net/lcm_port.h"
#include "platform/net/lcm_receiver.h"
#include "platform/net/multicast_port.h"
#include "platform/os/descriptor.h"

namespace axlecast {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::Pair;

constexpr std::uint16_t kPort = 17'667;
constexpr const char* kUrl = "udpm://239.255.76.67:17667?ttl=0";
constexpr std::array<std::uint8_t, 3> kMessage{1, 2, 3};
constexpr int kLimitMs = 30'000;  // generous: for a host that is busy with something else

using Received = std::vector<std::pair<std::string, std::vector<std::uint8_t>>>;

LcmPort::Handler Into(Received& received) {
  return [&received](const std::string& channel, Bytes message) {
    received.emplace_back(channel, std::vector<std::uint8_t>(message.begin(), message.end()));
  };
}

auto Carries(const char* channel) { return Pair(channel, ElementsAre(1, 2, 3)); }

std::ptrdiff_t Threads() {
  return std::distance(std::filesystem::directory_iterator("/proc/self/task"),
                       std::filesystem::directory_iterator());
}

// Sockets of this network that are bound to the port, whatever the address.
int SocketsAtPort() {
  std::ifstream table("/proc/net/udp");
  int count = 0;
  for (std::string line; std::getline(table, line);) {
    if (line.find(":4503 00000000:0000") != std::string::npos) ++count;  // 17667 in hexadecimal, no remote address
  }
  return count;
}

class RawSender {
 public:
  void Send(const std::vector<std::uint8_t>& bytes, const char* address = "239.255.76.67") const {
    sockaddr_in to{};
    to.sin_family = AF_INET;
    to.sin_port = htons(kPort);
    inet_pton(AF_INET, address, &to.sin_addr);
    ASSERT_EQ(
        sendto(socket_.get(), bytes.data(), bytes.size(), 0, reinterpret_cast<const sockaddr*>(&to), sizeof to),
        static_cast<ssize_t>(bytes.size()));
  }

 private:
  Descriptor socket_{socket(AF_INET, SOCK_DGRAM | SOCK_CLOEXEC, 0)};
};

// A port that only publishes must not receive, which would cost as much for every message of the group as to send one,
// and would open liblcm's receiver to the network. LCM's receiver has a thread of its own.
TEST(LcmGroup, APortThatOnlyPublishesOpensNoReceivingSocketAndNoThread) {
  const std::ptrdiff_t threads = Threads();
  LcmPort port(kUrl, "");
  ASSERT_EQ(port.problem(), "");
  port.Publish("POSITION/axis1", kMessage);
  EXPECT_TRUE(port.Handle(0));
  EXPECT_EQ(port.FileDescriptor(), -1);
  EXPECT_EQ(SocketsAtPort(), 0);
  EXPECT_EQ(Threads(), threads);
  ASSERT_TRUE(port.Subscribe("A", [](const std::string&, Bytes) {}));
  EXPECT_EQ(SocketsAtPort(), 1);
  EXPECT_EQ(Threads(), threads) << "liblcm receives";
}

TEST(LcmGroup, RefusesAndCountsTheMessagesOfAnotherMachine) {
  LcmPort port(kUrl, "", "press1");
  std::vector<std::string> received;
  ASSERT_TRUE(
      port.Subscribe("BUS/.*", [&received](const std::string& channel, Bytes) { received.push_back(channel); }));
  for (const char* machine : {"press2", "press1"}) {
    bus_health_t message{};
    message.machine = machine;
    message.machine_id = NameHash(machine);
    ASSERT_TRUE(Publish(port, std::string("BUS/") + machine, message));
  }
  while (received.empty()) ASSERT_TRUE(port.Handle(kLimitMs));
  EXPECT_THAT(received, ElementsAre("BUS/press1"));
  const ReceptionCounts counts = port.received();
  ASSERT_EQ(counts.machines.size(), 1U);
  EXPECT_EQ(counts.machines[0].name, "press2");
  EXPECT_THAT(ReceptionText(counts, ""), HasSubstr("machine 'press2' uses the same LCM group and port"));
  ReceptionReport report;
  EXPECT_TRUE(report.Changed(counts));
  EXPECT_NE(report.NextLine(counts, kSecond), "");
  EXPECT_FALSE(report.Changed(counts));
}

TEST(LcmGroup, DeliversWhatWasSubscribedBehindThePrefix) {
  LcmPort port(kUrl, "cell.1/");
  Received received;
  ASSERT_TRUE(port.Subscribe("POSITION/.*|DEVICE/axis1", Into(received)));
  LcmPort other(kUrl, "cell-1/");
  other.Publish("POSITION/axis1", kMessage);
  for (const char* channel : {"POSITION/axis1", "XPOSITION/axis1", "DEVICE/axis12", "DEVICE/axis1"}) {
    port.Publish(channel, kMessage);
  }
  port.Publish("POSITION/last", {});
  while (received.size() < 3) ASSERT_TRUE(port.Handle(kLimitMs));
  EXPECT_THAT(received,
              ElementsAre(Carries("POSITION/axis1"), Carries("DEVICE/axis1"), Pair("POSITION/last", IsEmpty())));
}

// Upstream's pull request 628: the first fragment's offset of 0xFFFFFFF0 and its length wrap around at 2^32, and liblcm
// 1.3.1 copies it 4 GB behind its buffer. Such a datagram ended every process that received through liblcm.
TEST(LcmGroup, AFragmentWhoseOffsetWrapsAroundIsRefused) {
  LcmPort port(kUrl, "");
  Received received;
  ASSERT_TRUE(port.Subscribe(".*", Into(received)));
  const RawSender sender;
  sender.Send(FragmentDatagram({.sequence = 1, .size = 64, .offset = 0xfffffff0, .number = 0, .count = 2},
                               "POSITION/axis1", std::string(64, 'x')));
  port.Publish("A", kMessage);
  while (received.empty()) ASSERT_TRUE(port.Handle(kLimitMs));
  EXPECT_THAT(received, ElementsAre(Carries("A")));
  EXPECT_EQ(port.received().malformed, 1);
}

TEST(LcmGroup, TakesFragmentsThatAreOrdinary) {
  LcmPort port(kUrl, "");
  Received received;
  ASSERT_TRUE(port.Subscribe("BIG", Into(received)));
  const std::vector<std::uint8_t> big(150'000, 7);
  port.Publish("BIG", big);
  while (received.empty()) ASSERT_TRUE(port.Handle(kLimitMs));
  EXPECT_EQ(received.front().second, big);
}

TEST(LcmGroup, WhatIsSentToTheHostsOwnAddressIsNotReceived) {
  LcmPort port(kUrl, "");
  Received received;
  ASSERT_TRUE(port.Subscribe(".*", Into(received)));
  RawSender().Send(ShortDatagram(0, "UNICAST", "x"), "127.0.0.1");
  port.Publish("A", kMessage);
  while (received.empty()) ASSERT_TRUE(port.Handle(kLimitMs));
  EXPECT_THAT(received, ElementsAre(Carries("A")));
}

// As with liblcm: what came on channels that nobody subscribed does not end the wait.
TEST(LcmGroup, MessagesOfOtherChannelsDoNotEndTheWait) {
  LcmPort port(kUrl, "");
  Received received;
  ASSERT_TRUE(port.Subscribe("A", Into(received)));
  LcmPort publisher(kUrl, "");
  for (int i = 0; i < 50; ++i) publisher.Publish("B", kMessage);
  publisher.Publish("A", kMessage);
  ASSERT_TRUE(port.Handle(kLimitMs));
  EXPECT_THAT(received, ElementsAre(Carries("A")));
}

TEST(LcmGroup, ItsFileIsReadableWhileThereIsWork) {
  LcmPort port(kUrl, "");
  Received received;
  ASSERT_TRUE(port.Subscribe("A", Into(received)));
  pollfd readable = {port.FileDescriptor(), POLLIN, 0};
  EXPECT_EQ(poll(&readable, 1, 0), 0);
  for (int i = 0; i < 3'000; ++i) port.Publish("A", kMessage);
  // One call handles a bounded number; the file stays readable while there is more.
  while (poll(&readable, 1, received.size() < 3'000 ? kLimitMs : 0) > 0) ASSERT_TRUE(port.Handle(0));
  EXPECT_EQ(static_cast<std::int64_t>(received.size()) + port.received().dropped, 3'000);
}

TEST(LcmGroup, CountsWhatTheKernelDropped) {
  LcmPort port("udpm://239.255.76.67:17667?ttl=0&recv_buf_size=8192", "");
  std::int64_t received = 0;
  ASSERT_TRUE(port.Subscribe("A", [&received](const std::string&, Bytes) { ++received; }));
  const std::vector<std::uint8_t> message(1'000, 1);
  for (int i = 0; i < 500; ++i) port.Publish("A", message);
  while (received + port.received().dropped < 500) ASSERT_TRUE(port.Handle(200));
  EXPECT_LT(received, 500);
  EXPECT_EQ(port.received().messages, received);
}

// 64 KiB for each of many datagrams may be reserved, but not touched: a driver has 12 MB in all.
TEST(LcmGroup, AnIdlePortTakesLittleMemory) {
  const auto resident = [] {
    std::ifstream file("/proc/self/statm");
    std::int64_t pages = 0;
    file >> pages >> pages;
    return pages * 4'096;
  };
  const std::int64_t before = resident();
  const MulticastPort port(*ParseLcmUrl(kUrl));
  ASSERT_EQ(port.problem(), "");
  EXPECT_LT(resident() - before, 512 << 10);
}

}  // namespace
}  // namespace axlecast
