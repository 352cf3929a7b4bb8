// Replies are laid out by hand after rtnetlink(7) and linux/can/netlink.h (kernel 6.1); the real kernel's are read in
// tests/vm/can_socket_test.cpp.

#include "drivers/hal/can_netlink.h"

#include <gtest/gtest.h>

#include <cerrno>
#include <initializer_list>
#include <vector>

namespace axlecast {
namespace {

using Text = std::vector<std::uint8_t>;
using State = CanController::State;

Text Word(std::uint32_t value) {
  Text bytes(4);
  for (std::size_t i = 0; i < 4; ++i) bytes[i] = static_cast<std::uint8_t>(value >> (8 * i));
  return bytes;
}

Text Joined(std::initializer_list<Text> parts) {
  Text all;
  for (const Text& part : parts) all.insert(all.end(), part.begin(), part.end());
  return all;
}

// Length and type in 16 bits each, then the value, filled up to a multiple of 4.
Text Attribute(std::uint32_t type, Text value) {
  Text bytes = Joined({Word(static_cast<std::uint32_t>(value.size() + 4) | type << 16), value});
  bytes.resize((bytes.size() + 3) / 4 * 4);
  return bytes;
}

constexpr std::uint32_t kArphrdCan = 280;
constexpr std::uint32_t kArphrdEther = 1;
constexpr std::uint32_t kUp = 1;

// nlmsghdr, ifinfomsg, attributes.
Text NewLink(std::uint32_t arphrd, std::uint32_t index, std::uint32_t flags, const Text& attributes) {
  const auto size = static_cast<std::uint32_t>(32 + attributes.size());
  return Joined({Word(size), Word(16), Word(1), Word(0),  // RTM_NEWLINK = 16
                 Word(arphrd << 16), Word(index), Word(flags), Word(0), attributes});
}

Text LinkInfo(const Text& kind, const Text& data) {
  return Attribute(18 | 0x8000, Joined({Attribute(1, kind), Attribute(2 | 0x8000, data)}));  // nested
}
const Text kCan = {'c', 'a', 'n', 0};

Text BitTiming(std::uint32_t bitrate) { return Attribute(1, Joined({Word(bitrate), Text(28)})); }
Text StateOf(std::uint32_t state) { return Attribute(4, Word(state)); }
Text Mode(std::uint32_t flags) { return Attribute(5, Joined({Word(0x1FF), Word(flags)})); }
Text RestartMs(std::uint32_t ms) { return Attribute(6, Word(ms)); }
Text Counters(std::uint32_t tec, std::uint32_t rec) { return Attribute(8, Word(tec | rec << 16)); }

CanInterface Parsed(const Text& reply) {
  const CanInterfaceReply parsed = ParseCanInterface(reply);
  EXPECT_TRUE(parsed);
  return parsed.value_or(CanInterface());
}
int ErrorIn(Bytes reply) {
  const CanInterfaceReply parsed = ParseCanInterface(reply);
  return parsed ? 0 : parsed.error();
}

TEST(CanNetlinkTest, AControllerTellsEverything) {
  const Text data = Joined({BitTiming(250'000), StateOf(2), Mode(0), RestartMs(100), Counters(136, 7)});
  const CanInterface can0 = Parsed(NewLink(kArphrdCan, 5, kUp,
                                           Joined({Attribute(3, {'c', 'a', 'n', '0', 0}), LinkInfo(kCan, data),
                                                   Attribute(56, {'1', '-', '2', 0})})));  // IFLA_PARENT_DEV_NAME
  EXPECT_EQ(can0.index, 5);
  EXPECT_TRUE(can0.is_can);
  EXPECT_TRUE(can0.up);
  EXPECT_TRUE(can0.is_controller);
  EXPECT_EQ(can0.state, State::kPassive);
  EXPECT_EQ(can0.bitrate, 250'000);
  EXPECT_EQ(can0.restart_ms, 100);
  EXPECT_EQ(can0.tec, 136);
  EXPECT_EQ(can0.rec, 7);
  EXPECT_TRUE(can0.restarts);
  EXPECT_FALSE(can0.listen_only || can0.loopback || can0.one_shot || can0.presume_ack);
}

TEST(CanNetlinkTest, StatesAndModes) {
  const State states[] = {State::kActive,  State::kWarning, State::kPassive, State::kBusOff,
                          State::kStopped, State::kStopped, State::kUnknown};
  for (std::uint32_t i = 0; i < 7; ++i) {
    EXPECT_EQ(Parsed(NewLink(kArphrdCan, 5, kUp, LinkInfo(kCan, StateOf(i)))).state, states[i]) << i;
  }
  EXPECT_TRUE(Parsed(NewLink(kArphrdCan, 5, kUp, LinkInfo(kCan, Mode(0x01)))).loopback);
  EXPECT_TRUE(Parsed(NewLink(kArphrdCan, 5, kUp, LinkInfo(kCan, Mode(0x02)))).listen_only);
  EXPECT_TRUE(Parsed(NewLink(kArphrdCan, 5, kUp, LinkInfo(kCan, Mode(0x08)))).one_shot);
  EXPECT_TRUE(Parsed(NewLink(kArphrdCan, 5, kUp, LinkInfo(kCan, Mode(0x40)))).presume_ack);
}

// slcan: its driver has nothing that restarts the controller.
TEST(CanNetlinkTest, AnAdapterOnASerialLineDoesNotRestart) {
  EXPECT_FALSE(Parsed(NewLink(kArphrdCan, 5, kUp, LinkInfo(kCan, BitTiming(250'000)))).restarts);
}

TEST(CanNetlinkTest, AnInterfaceThatIsDownIsStopped) {
  const CanInterface can0 = Parsed(NewLink(kArphrdCan, 5, 0, LinkInfo(kCan, StateOf(0))));
  EXPECT_FALSE(can0.up);
  EXPECT_EQ(can0.state, State::kStopped);
}

TEST(CanNetlinkTest, VcanTellsNothing) {
  const CanInterface vcan0 =
      Parsed(NewLink(kArphrdCan, 3, kUp, Attribute(18, Attribute(1, {'v', 'c', 'a', 'n', 0}))));
  EXPECT_TRUE(vcan0.is_can);
  EXPECT_TRUE(vcan0.up);
  EXPECT_FALSE(vcan0.is_controller);
  EXPECT_EQ(vcan0.state, State::kUnknown);
  EXPECT_EQ(vcan0.tec, -1);
  EXPECT_EQ(vcan0.bitrate, 0);
}

// A VLAN's attribute 1 is its number, 4 its protocol.
TEST(CanNetlinkTest, SettingsOfAnotherKindAreNotRead) {
  const CanInterface vlan =
      Parsed(NewLink(kArphrdEther, 2, kUp, LinkInfo({'v', 'l', 'a', 'n', 0}, Joined({BitTiming(7), StateOf(3)}))));
  EXPECT_FALSE(vlan.is_can);
  EXPECT_FALSE(vlan.is_controller);
  EXPECT_EQ(vlan.state, State::kUnknown);
  EXPECT_EQ(vlan.bitrate, 0);
}

TEST(CanNetlinkTest, RefusalsCarryTheirReason) {
  // NLMSG_ERROR = 2: the negative errno, then the question's header.
  const Text refusal = Joined({Word(36), Word(2), Word(1), Word(0), Word(static_cast<std::uint32_t>(-ENODEV)),
                               Word(40), Word(18), Word(1), Word(0)});
  EXPECT_EQ(ErrorIn(refusal), ENODEV);
  EXPECT_EQ(ErrorIn({}), EBADMSG);
  EXPECT_EQ(ErrorIn(Text(7)), EBADMSG);
  EXPECT_EQ(ErrorIn(Joined({Word(16), Word(3), Word(1), Word(0)})), EBADMSG);  // NLMSG_DONE
}

TEST(CanNetlinkTest, CutAndGarbledRepliesDoNoHarm) {
  const Text data = Joined({BitTiming(250'000), StateOf(2), Mode(0), RestartMs(100), Counters(136, 7)});
  const Text whole = NewLink(kArphrdCan, 5, kUp, LinkInfo(kCan, data));
  for (std::size_t size = 0; size < whole.size(); ++size) {
    Text cut(whole.begin(), whole.begin() + static_cast<std::ptrdiff_t>(size));
    EXPECT_EQ(ErrorIn(cut), EBADMSG) << size;
    if (size < 32) continue;
    cut[0] = static_cast<std::uint8_t>(size);  // a header that fits: attributes are cut
    EXPECT_EQ(Parsed(cut).index, 5) << size;
  }
  for (std::size_t at = 0; at < whole.size(); ++at) {
    for (const int value : {0, 1, 3, 4, 0x7F, 0xFF}) {
      Text garbled = whole;
      garbled[at] = static_cast<std::uint8_t>(value);
      static_cast<void>(ParseCanInterface(garbled));
    }
  }
}

TEST(CanNetlinkTest, TheKernelAnswers) {
  CanNetlink netlink;
  ASSERT_EQ(ErrorText(netlink.Open()), "");
  const CanInterfaceReply lo = netlink.Ask("lo");
  ASSERT_TRUE(lo);
  EXPECT_GT(lo->index, 0);
  EXPECT_FALSE(lo->is_can);
  for (const char* name : {"nocan0", "", "a-name-that-is-too-long"}) {
    const CanInterfaceReply none = netlink.Ask(name);
    ASSERT_FALSE(none) << name;
    EXPECT_EQ(none.error(), ENODEV) << name;
  }
}

}  // namespace
}  // namespace axlecast
