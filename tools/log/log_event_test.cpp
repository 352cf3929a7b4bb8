#include "tools/log/log_event.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <numeric>
#include <random>
#include <string>

namespace axlecast {
namespace {

using testing::ElementsAre;
using testing::ElementsAreArray;

// Written by hand after LCM's "LCM Log File Format": number 5, 1'000'000 us, channel "AB", data 0x7F 0x00.
constexpr std::uint8_t kRecord[] = {0xED, 0xA1, 0xDA, 0x01, 0, 0, 0, 0, 0, 0, 0, 5, 0,   0,   0,    0,
                                    0,    0x0F, 0x42, 0x40, 0, 0, 0, 2, 0, 0, 0, 2, 'A', 'B', 0x7F, 0};

TEST(LogEvent, IsWrittenAsTheFormatSays) {
  std::vector<std::uint8_t> log;
  const std::uint8_t data[] = {0x7F, 0x00};
  const LogEvent event{.number = 5, .utime = 1'000'000, .channel = "AB", .data = data};
  AppendEvent(log, event);
  EXPECT_THAT(log, ElementsAreArray(kRecord));
  EXPECT_EQ(EventSize(event), log.size());
}

TEST(LogEvent, IsReadAsTheFormatSays) {
  const auto event = ParseEvent(kRecord);
  ASSERT_TRUE(event);
  EXPECT_EQ(event->number, 5);
  EXPECT_EQ(event->utime, 1'000'000);
  EXPECT_EQ(event->channel, "AB");
  EXPECT_THAT(event->data, ElementsAreArray({0x7F, 0x00}));
}

TEST(LogEvent, ACutRecordIsNone) {
  for (std::size_t size = 0; size < sizeof(kRecord); ++size) EXPECT_FALSE(ParseEvent(Bytes(kRecord, size))) << size;
}

std::vector<std::uint8_t> With(std::size_t offset, std::vector<std::uint8_t> bytes) {
  std::vector<std::uint8_t> record(std::begin(kRecord), std::end(kRecord));
  std::copy(bytes.begin(), bytes.end(), record.begin() + static_cast<std::ptrdiff_t>(offset));
  record.resize(kLargestLogData + 1'000);
  return record;
}

TEST(LogEvent, LengthsThatNoRecorderWritesAreNone) {
  EXPECT_FALSE(ParseEvent(With(0, {0xED, 0xA1, 0xDA, 0x02})));
  EXPECT_FALSE(ParseEvent(With(20, {0, 0, 0, 0}))) << "a channel without a name";
  EXPECT_FALSE(ParseEvent(With(20, {0, 0, 1, 0}))) << "a channel of 256";
  EXPECT_FALSE(ParseEvent(With(20, {0xFF, 0xFF, 0xFF, 0xFF})));
  EXPECT_FALSE(ParseEvent(With(24, {0x04, 0, 0, 1}))) << "64 MiB and a byte";
  EXPECT_TRUE(ParseEvent(With(24, {0x04, 0, 0, 0})));
  EXPECT_FALSE(ParseEvent(With(24, {0xFF, 0xFF, 0xFF, 0xFF})));
  EXPECT_FALSE(ParseEvent(With(28, {'A', 0}))) << "NUL ends a channel";
}

TEST(LogEvent, TheExtremesComeBack) {
  const std::string channel(kLongestLogChannel, '\xFF');
  for (const std::int64_t number : {INT64_MIN, std::int64_t{-1}, INT64_MAX}) {
    std::vector<std::uint8_t> log;
    AppendEvent(log, {.number = number, .utime = ~number, .channel = channel, .data = {}});
    const auto event = ParseEvent(log);
    ASSERT_TRUE(event);
    EXPECT_EQ(event->number, number);
    EXPECT_EQ(event->utime, ~number);
    EXPECT_EQ(event->channel, channel);
    EXPECT_TRUE(event->data.empty());
  }
}

// RFC 3720, appendix B.4. It prints the bytes of the CRC as they are sent: the least significant one first.
TEST(Crc32c, AgreesWithRfc3720) {
  EXPECT_EQ(Crc32c(0, std::vector<std::uint8_t>(32, 0x00)), 0x8A9136AAU);
  EXPECT_EQ(Crc32c(0, std::vector<std::uint8_t>(32, 0xFF)), 0x62A8AB43U);
  std::vector<std::uint8_t> rising(32);
  std::iota(rising.begin(), rising.end(), std::uint8_t{0});
  EXPECT_EQ(Crc32c(0, rising), 0x46DD794EU);
  EXPECT_EQ(Crc32c(0, std::vector<std::uint8_t>(rising.rbegin(), rising.rend())), 0x113FDB5CU);
  // "An iSCSI - SCSI Read (10) Command PDU"
  const std::uint8_t read[] = {0x01, 0xC0, 0, 0, 0, 0, 0,    0, 0, 0, 0, 0,    0, 0, 0, 0,
                               0x14, 0,    0, 0, 0, 0, 0x04, 0, 0, 0, 0, 0x14, 0, 0, 0, 0x18,
                               0x28, 0,    0, 0, 0, 0, 0,    0, 2, 0, 0, 0,    0, 0, 0, 0};
  EXPECT_EQ(Crc32c(0, read), 0xD9963A56U);
}

// Bit by bit, the polynomial as RFC 3720 (12.1) writes it, over bits in the order of their sending.
std::uint32_t BitByBit(Bytes data) {
  std::uint32_t remainder = 0xFFFFFFFF;
  for (const std::uint8_t byte : data) {
    for (unsigned bit = 0; bit < 8; ++bit) {
      const std::uint32_t in = byte >> bit & 1U;
      const std::uint32_t out = remainder >> 31U;
      remainder <<= 1U;
      if (in != out) remainder ^= 0x1EDC6F41;
    }
  }
  std::uint32_t reflected = 0;
  for (unsigned bit = 0; bit < 32; ++bit) reflected |= (~remainder >> bit & 1U) << (31 - bit);
  return reflected;
}

TEST(Crc32c, AgreesWithItsDefinitionInOnePieceAndInTwo) {
  std::mt19937 random(1);
  for (std::size_t size = 0; size < 200; ++size) {
    std::vector<std::uint8_t> data(size);
    for (std::uint8_t& byte : data) byte = static_cast<std::uint8_t>(random());
    const std::uint32_t expected = BitByBit(data);
    EXPECT_EQ(Crc32c(0, data), expected) << size;
    const std::size_t cut = size == 0 ? 0 : random() % size;
    EXPECT_EQ(Crc32c(Crc32c(0, Bytes(data).first(cut)), Bytes(data).subspan(cut)), expected) << size << ' ' << cut;
  }
}

TEST(LogSeal, IsTwentyBytesBigEndian) {
  const LogSeal seal{.bytes = 0x0102030405060708, .events = 0x1112131415161718, .crc32c = 0x21222324};
  const std::vector<std::uint8_t> data = EncodeSeal(seal);
  EXPECT_THAT(data, ElementsAre(1, 2, 3, 4, 5, 6, 7, 8, 0x11, 0x12, 0x13, 0x14, 0x15, 0x16, 0x17, 0x18, 0x21, 0x22,
                                0x23, 0x24));
  EXPECT_EQ(ParseSeal(data), seal);
}

TEST(LogSeal, OfAnotherSizeIsNone) {
  for (std::size_t size = 0; size < 40; ++size) {
    EXPECT_EQ(ParseSeal(std::vector<std::uint8_t>(size)).has_value(), size == 20) << size;
  }
}

TEST(SealCount, CountsTheRecordsBehindTheLastSeal) {
  const std::string_view digits = "123456789";  // the check value of CRC-32C in the catalogues of CRCs: 0xE3069283
  const Bytes record(reinterpret_cast<const std::uint8_t*>(digits.data()), digits.size());
  SealCount count;
  count.Add(record.first(4));
  count.Add(record.subspan(4));
  EXPECT_EQ(count.seal(), (LogSeal{.bytes = 9, .events = 2, .crc32c = 0xE3069283}));
  count.Reset();
  EXPECT_EQ(count.seal(), LogSeal{});
}

TEST(LogHeader, KnowsItsChannels) {
  EXPECT_TRUE(IsLogChannel("AXLECAST/machine.yaml"));
  EXPECT_TRUE(IsLogChannel("AXLECAST/schema"));
  EXPECT_TRUE(IsLogChannel("AXLECAST/recorder"));
  EXPECT_TRUE(IsLogChannel("AXLECAST/seal"));
  EXPECT_FALSE(IsLogChannel("AXLECAST/"));
  EXPECT_FALSE(IsLogChannel("POSITION/axis1"));
}

}  // namespace

}  // namespace axlecast
