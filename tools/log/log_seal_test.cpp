#include "tools/log/log_seal.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <numeric>
#include <random>
#include <string>

#include "tools/log/log_event.h"
#include "tools/log/log_fixture.h"

namespace axlecast {
namespace {

using testing::ElementsAre;

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

TEST(LogTail, OfAnEmptyLogIsItsBeginning) {
  const LogTail tail = FindTail({});
  EXPECT_EQ(tail.size, 0U);
  EXPECT_EQ(tail.next_number, 0);
  EXPECT_EQ(tail.open.seal(), LogSeal{});
}

TEST(LogTail, OfALogThatIsCutAnywhereIsItsLastWholeRecord) {
  ScriptedLog log;
  log.Add("A", "one").Add("B", "two").Add("A", "three");
  for (std::size_t size = 0; size <= log.bytes().size(); ++size) {
    std::size_t whole = 0;
    while (whole < 3 && log.end(whole) <= size) ++whole;
    const LogTail tail = FindTail(Bytes(log.bytes()).first(size));
    EXPECT_EQ(tail.size, whole == 0 ? 0 : log.end(whole - 1)) << size;
    EXPECT_EQ(tail.torn, size - tail.size);
    EXPECT_EQ(tail.next_number, static_cast<std::int64_t>(whole)) << size;
    EXPECT_EQ(tail.open.seal().crc32c, Crc32c(0, Bytes(log.bytes()).first(tail.size))) << size;
  }
}

TEST(LogTail, TellsWhatTheNextSealHasToCover) {
  ScriptedLog log;
  log.Add("A", "one").Add(kSealChannel, EncodeSeal({})).Add("A", "two").Add("A", "three");
  const LogTail tail = FindTail(log.bytes());
  const Bytes open = Bytes(log.bytes()).subspan(log.offsets()[2]);
  EXPECT_EQ(tail.open.seal(), (LogSeal{.bytes = open.size(), .events = 2, .crc32c = Crc32c(0, open)}));
}

TEST(LogTail, DamageBeforeTheEndIsNotItsConcern) {
  ScriptedLog log;
  log.Add("A", "one").Add("B", "two").Add("A", "three");
  std::vector<std::uint8_t> bytes = log.bytes();
  bytes[log.offsets()[1]] = 0;
  EXPECT_EQ(FindTail(bytes).size, bytes.size());
}

TEST(LogTail, OnlyTheEndIsReadWhereASealStandsThere) {
  for (const bool sealed : {true, false}) {
    ScriptedLog log;
    for (int i = 0; i < 100; ++i) log.Add("CHANNEL", "some data");
    if (sealed) log.Add(kSealChannel, EncodeSeal({}));
    log.Add("LAST", "x");
    for (const std::size_t look : {std::size_t{300}, std::size_t{1'000}, log.bytes().size()}) {
      std::vector<std::uint8_t> bytes = log.bytes();
      bytes[log.offsets()[1]] = 0;  // told apart by what is counted
      const LogTail tail = FindTail(bytes, look);
      EXPECT_EQ(tail.size, bytes.size());
      EXPECT_EQ(tail.next_number, sealed ? 102 : 101);
      EXPECT_EQ(tail.open.seal().events, sealed ? 1U : 100U);
    }
  }
}

}  // namespace

}  // namespace axlecast
