// LcmPort by an interface that comes and goes, in a network of the test's own. What another host sends: tests/e2e/test_interface.py, too.
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <poll.h>

#include <array>
#include <string>

#include "platform/net/interface_test_support.h"
#include "platform/net/lcm_port.h"
#include "platform/net/lcm_receiver.h"
#include "platform/os/system_clock.h"

namespace axlecast {
namespace {

using ::testing::HasSubstr;

constexpr std::array<std::uint8_t, 3> kMessage{1, 2, 3};
constexpr MonoNs kLimit = 30 * kSecond;  // generous: for a host that is busy with something else

// A port that receives what it sends itself by the interface.
class OwnPort {
 public:
  explicit OwnPort(const std::string& url) : port_(url, "") {
    EXPECT_EQ(port_.problem(), "");
    EXPECT_TRUE(port_.Subscribe("A", [this](const std::string&, Bytes) { ++received_; }));
  }

  // Publishes and waits like a program, until a message arrives.
  [[nodiscard]] bool Works() {
    const int before = received_;
    for (const MonoNs end = clock_.Now() + kLimit; clock_.Now() < end && received_ == before;) {
      port_.Publish("A", kMessage);
      pollfd readable{port_.FileDescriptor(), POLLIN, 0};
      if (poll(&readable, 1, 10) > 0) {
        EXPECT_TRUE(port_.Handle(0));
      }
    }
    return received_ > before;
  }

  // Waits until the port reports this problem. Returns the last one.
  [[nodiscard]] std::string Problem(const char* expected) {
    const auto reported = [&] { return port_.received().network.find(expected) != std::string::npos; };
    for (const MonoNs end = clock_.Now() + kLimit; clock_.Now() < end && !reported();) {
      pollfd readable{port_.FileDescriptor(), POLLIN, 0};
      if (poll(&readable, 1, 1'000) > 0) {
        EXPECT_TRUE(port_.Handle(0));
      }
    }
    return port_.received().network;
  }

  LcmPort& port() { return port_; }

 private:
  const SystemClock clock_;
  LcmPort port_;
  int received_ = 0;
};

class LcmInterface : public ::testing::TestWithParam<const char*> {
 protected:
  Links links_;
};

TEST_P(LcmInterface, ThatIsMissingAtTheStartIsUsedAsSoonAsItIsMade) {
  OwnPort own(GetParam());
  EXPECT_THAT(own.Problem("this host has no interface net1"), HasSubstr("this host has no interface net1"));
  own.port().Publish("A", kMessage);
  EXPECT_EQ(own.port().unsent(), 1);
  MakeLink("net1", "10.1.0.1/24");
  EXPECT_TRUE(own.Works());
  EXPECT_EQ(own.port().received().network, "");
}

TEST_P(LcmInterface, ThatIsDeletedAndMadeAgainIsJoinedAgain) {
  MakeLink("net1", "10.1.0.1/24");
  OwnPort own(GetParam());
  EXPECT_TRUE(own.Works());
  for (int round = 0; round < 2; ++round) {
    Shell("ip link del net1");
    EXPECT_THAT(own.Problem("this host has no interface net1"), HasSubstr("this host has no interface net1"));
    MakeLink("net1", "10.1.0.1/24");
    EXPECT_TRUE(own.Works()) << own.port().received().network;
  }
}

TEST_P(LcmInterface, ThatWasDownIsUsedAgain) {
  MakeLink("net1", "10.1.0.1/24");
  OwnPort own(GetParam());
  EXPECT_TRUE(own.Works());
  Shell("ip link set net1 down");
  EXPECT_THAT(own.Problem("the interface net1 is down"), HasSubstr("the interface net1 is down"));
  Shell("ip link set net1 up");
  EXPECT_TRUE(own.Works()) << own.port().received().network;
}

INSTANTIATE_TEST_SUITE_P(, LcmInterface,
                         ::testing::Values("udpm://239.255.76.71:17671?ttl=1&interface=net1",
                                           "udpm://239.255.76.71:17671?ttl=0&interface=net1",
                                           "udpm://[ff15::4c43]:17671?ttl=1&interface=net1",
                                           "udpm://[ff15::4c43]:17671?ttl=0&interface=net1"));

TEST(LcmInterfaceOfAnAddress, FollowsTheAddressToAnotherInterface) {
  const Links links;
  MakeLink("net1", "10.1.0.1/24");
  OwnPort own("udpm://239.255.76.71:17671?ttl=1&interface=10.1.0.1");
  EXPECT_TRUE(own.Works());
  Shell("ip link del net1");
  EXPECT_THAT(own.Problem("no interface of this host has the address 10.1.0.1"),
              HasSubstr("no interface of this host has the address 10.1.0.1"));
  MakeLink("net2", "10.1.0.1/24");
  EXPECT_TRUE(own.Works());
  LinkCapture second("net2x");
  own.port().Publish("AFTER", kMessage);
  EXPECT_EQ(second.Count("AFTER"), 1);
}

// Sends a UDP datagram without a checksum to 239.255.76.71:17671 as the host 10.1.0.9, which is at the end `interface` of a link.
void SendAsAnotherHost(const std::string& interface, const std::string& text) {
  const auto size = static_cast<std::uint8_t>(text.size());
  std::vector<std::uint8_t> frame = {0x01, 0x00, 0x5e, 0x7f, 76, 71, 2, 0, 0, 0, 0, 9, 0x08, 0x00};  // Ethernet
  std::array<std::uint8_t, 20> ip = {
      0x45, 0, 0, static_cast<std::uint8_t>(28 + size), 0, 0, 0, 0, 1, 17, 0, 0, 10, 1, 0, 9, 239, 255, 76, 71};
  unsigned sum = 0;
  for (std::size_t i = 0; i < ip.size(); i += 2) sum += static_cast<unsigned>(ip[i] << 8 | ip[i + 1]);
  sum = ~((sum & 0xffff) + (sum >> 16));
  ip[10] = static_cast<std::uint8_t>(sum >> 8);
  ip[11] = static_cast<std::uint8_t>(sum);
  frame.insert(frame.end(), ip.begin(), ip.end());
  frame.insert(frame.end(), {0x9c, 0x40, 0x45, 0x07, 0, static_cast<std::uint8_t>(8 + size), 0, 0});  // UDP
  frame.insert(frame.end(), text.begin(), text.end());
  const Descriptor socket_of_link(socket(AF_PACKET, SOCK_RAW | SOCK_CLOEXEC, 0));
  sockaddr_ll place{};
  place.sll_family = AF_PACKET;
  place.sll_ifindex = static_cast<int>(if_nametoindex(interface.c_str()));
  ASSERT_EQ(sendto(socket_of_link.get(), frame.data(), frame.size(), 0, reinterpret_cast<const sockaddr*>(&place),
                   sizeof place),
            std::ssize(frame));
}

// Reads until a datagram has come, and returns the counts.
ReceptionCounts CountsOfOne(const std::string& url, std::vector<std::string>& channels) {
  LcmReceiver receiver(*ParseLcmUrl(url));
  EXPECT_EQ(receiver.problem(), "");
  SendAsAnotherHost("net1x", std::string("LC02\0\0\0\0A\0x", 11));
  const SystemClock clock;
  const auto sink = [&channels](std::string_view channel, Bytes) { channels.emplace_back(channel); };
  for (const MonoNs end = clock.Now() + kLimit; receiver.Read(sink) == 0 && clock.Now() < end;) {
    pollfd readable{receiver.FileDescriptor(), POLLIN, 0};
    static_cast<void>(poll(&readable, 1, 10));
  }
  return receiver.counts();
}

TEST(LcmInterfaceOfAnotherHost, WhatItSendsIsRefusedAndCountedIfTheTtlIs0) {
  const Links links;
  MakeLink("net1", "10.1.0.1/24");
  std::vector<std::string> channels;
  const ReceptionCounts refused = CountsOfOne("udpm://239.255.76.71:17671?ttl=0&interface=net1", channels);
  EXPECT_TRUE(channels.empty());
  EXPECT_EQ(refused.outside, 1);
  EXPECT_EQ(refused.malformed, 0);
  const ReceptionCounts taken = CountsOfOne("udpm://239.255.76.71:17671?ttl=1&interface=net1", channels);
  EXPECT_EQ(channels, std::vector<std::string>{"A"});
  EXPECT_EQ(taken.outside, 0);
}

}  // namespace
}  // namespace axlecast
