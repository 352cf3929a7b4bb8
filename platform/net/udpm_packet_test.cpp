#include "platform/net/udpm_packet.h"

#include <gtest/gtest.h>

#include <string>

#include "platform/net/datagram_test_support.h"

namespace axlecast {
namespace {

std::vector<std::uint8_t> FromHex(std::string_view hex) {
  std::vector<std::uint8_t> bytes;
  for (std::size_t i = 0; i < hex.size(); i += 2) {
    bytes.push_back(static_cast<std::uint8_t>(std::stoul(std::string(hex.substr(i, 2)), nullptr, 16)));
  }
  return bytes;
}

std::string Text(Bytes bytes) { return {bytes.begin(), bytes.end()}; }

bool IsRefused(const FragmentFields& fields, std::string_view payload) {
  return !ParseUdpm(FragmentDatagram(fields, "BIG", payload));
}

// Sent by stock liblcm 1.3.1 (Debian 12): lcm_publish(lcm, "POSITION/axis1", {1, 2, 3, 4, 5}, 5), its first message.
TEST(UdpmPacketTest, ReadsAShortMessageOfStockLcm) {
  const auto datagram = FromHex("4c43303200000000504f534954494f4e2f6178697331000102030405");
  const auto packet = ParseUdpm(datagram);
  ASSERT_TRUE(packet);
  const auto& message = std::get<ShortPacket>(*packet);
  EXPECT_EQ(message.sequence, 0U);
  EXPECT_EQ(message.channel, "POSITION/axis1");
  EXPECT_EQ(Text(message.payload), "\x01\x02\x03\x04\x05");
}

// The second: lcm_publish(lcm, "EMPTY", "", 0).
TEST(UdpmPacketTest, ReadsAnEmptyMessageOfStockLcm) {
  const auto datagram = FromHex("4c43303200000001454d50545900");
  const auto packet = ParseUdpm(datagram);
  ASSERT_TRUE(packet);
  EXPECT_EQ(std::get<ShortPacket>(*packet).sequence, 1U);
  EXPECT_EQ(std::get<ShortPacket>(*packet).channel, "EMPTY");
  EXPECT_TRUE(std::get<ShortPacket>(*packet).payload.empty());
}

// The third: 150,000 bytes on "BIG". Its fragments 0 and 2, the headers as captured, of 65,507 and 19,050 bytes.
TEST(UdpmPacketTest, ReadsFragmentsOfStockLcm) {
  auto first = FromHex("4c43303300000002000249f0000000000000000342494700");
  first.resize(65'507, 7);
  const auto packet = ParseUdpm(first);
  ASSERT_TRUE(packet);
  const auto& fragment = std::get<FragmentPacket>(*packet);
  EXPECT_EQ(fragment.sequence, 2U);
  EXPECT_EQ(fragment.size, 150'000U);
  EXPECT_EQ(fragment.offset, 0U);
  EXPECT_EQ(fragment.number, 0);
  EXPECT_EQ(fragment.count, 3);
  EXPECT_EQ(fragment.channel, "BIG");
  EXPECT_EQ(fragment.payload.size(), 65'483U);

  auto last = FromHex("4c43303300000002000249f00001ff9a00020003");
  last.resize(19'050, 7);
  const auto end = ParseUdpm(last);
  ASSERT_TRUE(end);
  EXPECT_EQ(std::get<FragmentPacket>(*end).offset, 130'970U);
  EXPECT_EQ(std::get<FragmentPacket>(*end).offset + std::get<FragmentPacket>(*end).payload.size(), 150'000U);
  EXPECT_TRUE(std::get<FragmentPacket>(*end).channel.empty());
}

TEST(UdpmPacketTest, TakesChannelsOfUpTo63Characters) {
  EXPECT_TRUE(ParseUdpm(ShortDatagram(1, std::string(63, 'c'), "x")));
  EXPECT_FALSE(ParseUdpm(ShortDatagram(1, std::string(64, 'c'), "x")));
  EXPECT_FALSE(ParseUdpm(ShortDatagram(1, "", "x")));
}

TEST(UdpmPacketTest, RefusesWhatIsNotLcm) {
  EXPECT_FALSE(ParseUdpm({}));
  EXPECT_FALSE(ParseUdpm(DatagramText().U32(0x4c433031).U32(1).Channel("A").bytes));
  EXPECT_FALSE(ParseUdpm(DatagramText().U32(0x4c433032).Text("abc").bytes));
  EXPECT_FALSE(ParseUdpm(DatagramText().U32(0x4c433032).U32(1).Text("NO_END").bytes));
}

TEST(UdpmPacketTest, RefusesEveryCutFragmentHeader) {
  const auto whole = FragmentDatagram({.sequence = 1, .size = 9, .number = 0, .count = 2}, "BIG", "");
  EXPECT_TRUE(ParseUdpm(whole));
  for (std::size_t size = 0; size < whole.size(); ++size) EXPECT_FALSE(ParseUdpm(Bytes(whole).first(size))) << size;
}

TEST(UdpmPacketTest, RefusesFragmentsThatContradictThemselves) {
  EXPECT_FALSE(IsRefused({.size = 9, .offset = 4, .number = 1, .count = 2}, "12345"));
  EXPECT_TRUE(IsRefused({.size = 9, .offset = 5, .number = 1, .count = 2}, "12345")) << "beyond the message";
  EXPECT_TRUE(IsRefused({.size = 9, .offset = 0xfffffffe, .number = 1, .count = 2}, "12345")) << "wraps around";
  EXPECT_TRUE(IsRefused({.size = 9, .offset = 4, .number = 2, .count = 2}, "12345")) << "no such fragment";
  EXPECT_TRUE(IsRefused({.size = 9, .number = 0, .count = 0}, "")) << "of none";
  EXPECT_TRUE(IsRefused({.size = 9, .offset = 4, .number = 1, .count = 2}, "")) << "brings nothing";
  EXPECT_TRUE(IsRefused({.size = 9, .offset = 1, .number = 0, .count = 2}, "1"))
      << "the first is not the beginning";
  EXPECT_TRUE(IsRefused({.size = 9, .number = 0, .count = 1}, "12345")) << "the only one is not all";
  EXPECT_TRUE(IsRefused({.size = 9, .number = 0, .count = 2}, "123456789")) << "nothing is left for the other";
  EXPECT_TRUE(IsRefused({.size = 9, .offset = 4, .number = 1, .count = 11}, "1")) << "more fragments than bytes";
  EXPECT_TRUE(IsRefused({.size = (1U << 28) + 1, .number = 0, .count = 2}, "1")) << "larger than LCM sends";
}

}  // namespace
}  // namespace axlecast
