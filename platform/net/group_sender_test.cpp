// GroupSender in a network of the test's own.
#include "platform/net/group_sender.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <lcm/lcm.h>
#include <poll.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstring>
#include <string>
#include <vector>

#include "platform/net/interface_test_support.h"
#include "platform/net/lcm_port.h"
#include "platform/net/multicast_port.h"

namespace axlecast {
namespace {

using ::testing::AnyOf;
using ::testing::Eq;
using ::testing::HasSubstr;

constexpr const char* kUrl = "udpm://239.255.76.70:17670?ttl=0";
constexpr int kLimitMs = 30'000;  // generous: for a host that is busy with something else
constexpr std::array<std::uint8_t, 3> kMessage{1, 2, 3};

using Datagram = std::vector<std::uint8_t>;

// Returns the next `count` datagrams.
std::vector<Datagram> Take(MulticastPort& port, std::size_t count) {
  std::vector<Datagram> taken;
  pollfd readable{port.FileDescriptor(), POLLIN, 0};
  while (taken.size() < count && poll(&readable, 1, kLimitMs) > 0) {
    for (const auto& received : port.Read()) taken.emplace_back(received.bytes.begin(), received.bytes.end());
  }
  return taken;
}

std::vector<std::uint8_t> Pattern(std::size_t size) {
  std::vector<std::uint8_t> bytes(size);
  for (std::size_t i = 0; i < size; ++i) bytes[i] = static_cast<std::uint8_t>(i * 7 + i / 251);
  return bytes;
}

// The peer is stock liblcm. Sizes around its limits: 65,499 bytes in one datagram, 65,487 in a fragment.
TEST(GroupSender, ItsDatagramsAreThoseOfLiblcm) {
  MulticastPort port(*ParseLcmUrl(kUrl));
  ASSERT_EQ(port.problem(), "");
  lcm_t* liblcm = lcm_create(kUrl);
  ASSERT_NE(liblcm, nullptr);
  GroupSender sender(*ParseLcmUrl(kUrl));
  for (const std::string& channel : {std::string("POSITION/axis1"), std::string("A"), std::string(63, 'n')}) {
    const std::size_t named = channel.size() + 1;
    for (const std::size_t size : {std::size_t{0}, std::size_t{1}, 65'499 - named, 65'500 - named,
                                   65'487 * 2 - named, 65'487 * 2 - named + 1, std::size_t{200'000}}) {
      const auto message = Pattern(size);
      const std::size_t total = named + size;
      const std::size_t count = total <= 65'499 ? 1 : (total + 65'486) / 65'487;
      ASSERT_EQ(lcm_publish(liblcm, channel.c_str(), message.data(), static_cast<unsigned>(size)), 0);
      const auto expected = Take(port, count);
      ASSERT_TRUE(sender.Send(channel, message));
      EXPECT_EQ(Take(port, count), expected) << channel << ' ' << size;
    }
  }
  lcm_destroy(liblcm);
}

TEST(GroupSender, RefusesWhatHasNoChannelAndWhatIsTooLong) {
  GroupSender sender(*ParseLcmUrl(kUrl));
  EXPECT_FALSE(sender.Send("", kMessage));
  EXPECT_TRUE(sender.Send("A", kMessage));
  EXPECT_EQ(ErrorText(sender.Check()), "");
}

TEST(GroupSender, WithoutARouteItReportsTheError) {
  Shell("ip route del 224.0.0.0/4 dev lo");
  GroupSender sender(*ParseLcmUrl(kUrl));
  EXPECT_FALSE(sender.Send("A", kMessage));
  EXPECT_THAT(ErrorText(sender.Check()), HasSubstr("cannot be sent: Network is unreachable"));
  Shell("ip route add 224.0.0.0/4 dev lo");
  EXPECT_TRUE(sender.Send("A", kMessage));
  EXPECT_EQ(ErrorText(sender.Check()), "");
}

TEST(GroupSender, SendsByTheInterfaceOfTheUrlOnly) {
  const Links links;
  MakeLink("net1", "10.1.0.1/24");
  MakeLink("net2", "10.2.0.1/24");
  LinkCapture first("net1x");
  LinkCapture second("net2x");
  for (const char* text : {"net2", "10.2.0.1", "10.2.0.0/24"}) {
    GroupSender sender(*ParseLcmUrl(WithInterface("udpm://239.255.76.70:17670?ttl=1", text)));
    const std::string channel = std::string("BY/") + text;
    ASSERT_TRUE(sender.Send(channel, kMessage)) << ErrorText(sender.Check());
    EXPECT_EQ(second.Count(channel), 1);
    EXPECT_EQ(first.Count(channel), 0);
  }
}

// With a route by another interface, a socket without the option would send by it.
TEST(GroupSender, WithoutItsInterfaceItSendsNothingAtAll) {
  const Links links;
  MakeLink("net1", "10.1.0.1/24");
  Shell("ip route add 239.255.76.70/32 dev net1");
  LinkCapture other("net1x");
  GroupSender sender(*ParseLcmUrl("udpm://239.255.76.70:17670?ttl=1&interface=net2"));
  EXPECT_FALSE(sender.Send("MISSING", kMessage));
  EXPECT_THAT(ErrorText(sender.Check()), HasSubstr("this host has no interface net2"));
  MakeLink("net2", "10.2.0.1/24");
  const SystemClock clock;
  const MonoNs end = clock.Now() + kLimitMs * kMillisecond;
  while (!sender.Send("MADE", kMessage) && clock.Now() < end) poll(nullptr, 0, 5);
  EXPECT_EQ(ErrorText(sender.Check()), "");
  Shell("ip link del net2");
  EXPECT_FALSE(sender.Send("DELETED", kMessage));
  EXPECT_EQ(other.Count("MISSING") + other.Count("MADE") + other.Count("DELETED"), 0);
}

TEST(GroupSender, StatesThatTheInterfaceIsDownOrHasNoCarrier) {
  const Links links;
  MakeLink("net1", "10.1.0.1/24");
  const auto problem = [](const char* ttl) {
    return ErrorText(
        GroupSender(*ParseLcmUrl(std::string("udpm://239.255.76.70:17670?interface=net1&ttl=") + ttl)).Check());
  };
  EXPECT_EQ(problem("1"), "");
  Shell("ip link set net1x down");
  EXPECT_THAT(problem("1"), HasSubstr("the interface net1 has no carrier"));
  EXPECT_EQ(problem("0"), "") << "no other host is to be reached";
  Shell("ip link set net1 down");
  EXPECT_THAT(problem("0"), HasSubstr("`ip link set net1 up`"));
}

// A port that sends seldom: its problem ends with that of the interface, not with the next message.
TEST(GroupSender, TheProblemEndsWithoutAnotherMessage) {
  const Links links;
  MakeLink("net1", "10.1.0.1/24");
  GroupSender sender(*ParseLcmUrl("udpm://239.255.76.70:17670?ttl=1&interface=net1"));
  Shell("ip link set net1 down");
  EXPECT_FALSE(sender.Send("A", kMessage));
  const SystemClock clock;
  const auto wait = [&](bool problem) {
    const MonoNs end = clock.Now() + kLimitMs * kMillisecond;
    while (sender.Check().has_value() == problem && clock.Now() < end) poll(nullptr, 0, 5);
    return ErrorText(sender.Check());
  };
  EXPECT_THAT(wait(true), HasSubstr("net1"));
  Shell("ip link set net1 up");
  EXPECT_EQ(wait(false), "");
}

TEST(FindInterface, ANetworkMustSelectOne) {
  const Links links;
  MakeLink("net1", "10.1.0.1/24");
  MakeLink("net2", "10.2.0.1/24");
  EXPECT_EQ(FindInterface("10.2.0.0/16")->name, "net2");
  EXPECT_EQ(FindInterface("10.1.0.1")->name, "net1");
  EXPECT_THAT(ErrorText(FindInterface("10.0.0.0/8")),
              HasSubstr("several interfaces have an address in 10.0.0.0/8: net1, net2"));
  EXPECT_THAT(ErrorText(FindInterface("10.3.0.0/16")),
              HasSubstr("no interface of this host has an address in 10.3.0.0/16"));
  EXPECT_THAT(ErrorText(FindInterface("10.1.0.9")), HasSubstr("has the address 10.1.0.9"));
  EXPECT_TRUE(FindInterface("127.0.0.1")->loopback);
}

}  // namespace
}  // namespace axlecast
