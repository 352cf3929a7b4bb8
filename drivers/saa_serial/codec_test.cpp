#include "drivers/saa_serial/codec.h"

#include <gtest/gtest.h>

#include <map>
#include <string>

#include "core/device/line_settings.h"
#include "core/device/operation.h"
#include "tests/support/golden_file.h"

namespace axlecast::saa_serial {
namespace {

const std::map<std::string, ReplyHeader> kHeaders = {
    {"either", ReplyHeader::kEither}, {"address", ReplyHeader::kAddress}, {"81", ReplyHeader::kFixed}};
const std::map<ReplyError, std::string> kErrors = {
    {ReplyError::kShort, "short"},       {ReplyError::kLong, "long"},     {ReplyError::kStart, "start"},
    {ReplyError::kChecksum, "checksum"}, {ReplyError::kHeader, "header"}, {ReplyError::kRange, "range"}};

TEST(SaaCodec, TheManualsExample) {
  for (const GoldenRow& row : GoldenRows(__FILE__, "manual.txt", 4)) {
    const int bits = std::stoi(row.columns[1]);
    const Reply reply = ParseReply(GoldenBytes(row.columns[0]), {.bits = bits});
    EXPECT_EQ(reply.error, ReplyError::kNone) << row.where;
    EXPECT_EQ(reply.counts, std::stoul(row.columns[2])) << row.where;
    EXPECT_NEAR(Degrees(reply.counts, bits), std::stod(row.columns[3]), 0.00005) << row.where;
  }
}

// 5.1.1 (1) to 5.3.4 (1): "0xff 0x81 0xd0 ..." as bits on TXD+ and TXD-, and 5: start bit, 8 data bits LSB first, no
// parity, one stop bit.
TEST(SaaCodec, TheWaveformExampleIsThreeCharacters) {
  const std::string plus = "0 1111 1111 1 0 1000 0001 1 0 0000 1011 1";
  const std::string minus = "1 0000 0000 0 1 0111 1110 0 1 1111 0100 0";
  const LineFormat line{.baud = 9'600};
  std::string bits;
  for (std::size_t i = 0; i < plus.size(); ++i) {
    if (plus[i] == ' ') continue;
    EXPECT_NE(plus[i], minus[i]);
    bits += plus[i];
  }
  const auto character = static_cast<std::size_t>(line.BitsPerCharacter());
  ASSERT_EQ(bits.size(), 3 * character);
  std::vector<std::uint8_t> bytes;
  for (std::size_t at = 0; at < bits.size(); at += character) {
    EXPECT_EQ(bits[at], '0');
    EXPECT_EQ(bits[at + 9], '1');
    std::uint8_t byte = 0;
    for (std::size_t i = 8; i > 0; --i) byte = static_cast<std::uint8_t>(byte << 1U | (bits[at + i] - '0'));
    bytes.push_back(byte);
  }
  EXPECT_EQ(bytes, GoldenBytes("FF 81 D0"));
  // They begin a frame: D0 is the top byte of its position. At 16 bits the sum behind D000 is 50.
  EXPECT_EQ(LengthRule(16)(bytes), 5U);
  bytes.insert(bytes.end(), {0x00, 0x50});
  const Reply reply = ParseReply(bytes, {.bits = 16});
  EXPECT_EQ(reply.error, ReplyError::kNone);
  EXPECT_EQ(reply.counts, 0xD000U);
}

TEST(SaaCodec, EveryRowOfTheTables) {
  for (const GoldenRow& row : GoldenRows(__FILE__, "replies.txt", 5)) {
    Format format{.bits = std::stoi(row.columns[1]), .header = kHeaders.at(row.columns[2])};
    format.address = GoldenBytes(row.columns[3]).at(0);
    const Reply reply = ParseReply(GoldenBytes(row.columns[0]), format);
    if (row.columns[4].starts_with("error=")) {
      ASSERT_NE(reply.error, ReplyError::kNone) << row.where;
      EXPECT_EQ(kErrors.at(reply.error), row.columns[4].substr(6)) << row.where;
    } else {
      EXPECT_EQ(reply.error, ReplyError::kNone) << row.where;
      EXPECT_EQ(std::to_string(reply.counts), row.columns[4]) << row.where;
    }
  }
}

// Tables (2): "≤16bit", "17~24bit", ">24bit".
TEST(SaaCodec, TheResolutionDecidesTheLength) {
  for (int bits = 10; bits <= 26; ++bits) {
    const std::size_t size = bits <= 16 ? 5 : bits <= 24 ? 6 : 7;
    EXPECT_EQ(ReplySize(bits), size) << bits;
    for (std::size_t length = 3; length < 10; ++length) {
      std::vector<std::uint8_t> frame(length, 0);  // position 0, and its sum
      frame[0] = 0xFF;
      frame[1] = 0x81;
      frame.back() = 0x80;
      const ReplyError expected = length < size   ? ReplyError::kShort
                                  : length > size ? ReplyError::kLong
                                                  : ReplyError::kNone;
      EXPECT_EQ(ParseReply(frame, {.bits = bits}).error, expected) << bits << " bits, " << length << " bytes";
    }
  }
}

TEST(SaaCodec, Requests) {
  for (const GoldenRow& row : GoldenRows(__FILE__, "requests.txt", 2)) {
    const auto bytes = GoldenBytes(row.columns[0]);
    const std::uint8_t command = GoldenBytes(row.columns[1]).at(0);
    EXPECT_EQ(ParseRequest(bytes), command) << row.where;
    const Frame made = Request(command);
    EXPECT_EQ(std::vector<std::uint8_t>(made.data(), made.data() + made.size()), bytes) << row.where;
  }
  for (const char* none : {"", "BC", "BC AA", "BC AB B1", "BB AA B1", "BC AA B1 00"}) {
    EXPECT_FALSE(ParseRequest(GoldenBytes(none))) << none;
  }
}

// The sum finds every single flipped bit, and every burst within one byte.
TEST(SaaCodec, NoSingleDamagedBytePasses) {
  const Format format{.bits = 24};
  const std::vector<std::uint8_t> good = GoldenBytes("FF 81 12 34 56 1C");
  for (std::size_t at = 0; at < good.size(); ++at) {
    for (unsigned flips = 1; flips < 256; ++flips) {
      std::vector<std::uint8_t> bad = good;
      bad[at] = static_cast<std::uint8_t>(bad[at] ^ flips);
      EXPECT_NE(ParseReply(bad, format).error, ReplyError::kNone) << at << ' ' << flips;
    }
  }
}

// What an 8-bit sum cannot see: swapped bytes, and changes that cancel. Plausibility has to.
TEST(SaaCodec, TheSumIsBlindToSwapsAndToChangesThatCancel) {
  EXPECT_EQ(ParseReply(GoldenBytes("FF 81 34 12 56 1C"), {.bits = 24}).error, ReplyError::kNone);
  EXPECT_EQ(ParseReply(GoldenBytes("FF 81 13 33 56 1C"), {.bits = 24}).error, ReplyError::kNone);
}

// ---- what a reply answers ----

ReplyMatch Match(const std::string& reply, const Format& format, std::uint8_t address = 0) {
  const Frame request = Request(address);
  return ShapeOf(format).match(format.header == ReplyHeader::kFixed ? Bytes() : Bytes(request), GoldenBytes(reply));
}

TEST(SaaCodec, AFrameMatchesByItsHeader) {
  const Format fixed{.bits = 14};
  EXPECT_EQ(Match("FF 81 12 34 C6", fixed), ReplyMatch::kYes);
  EXPECT_EQ(Match("FF 81 12 34 C7", fixed), ReplyMatch::kDamaged);
  EXPECT_EQ(Match("FF 80 12 34 C6", fixed), ReplyMatch::kNearly) << "one bit of the header";
  EXPECT_EQ(Match("FE 80 12 34 C6", fixed), ReplyMatch::kNearly) << "two bits";
  EXPECT_EQ(Match("FC 81 12 34 C6", fixed), ReplyMatch::kNearly);
  EXPECT_EQ(Match("FF 86 12 34 C6", fixed), ReplyMatch::kNo) << "three bits";
  EXPECT_EQ(Match("FF 83 12 34 C8", fixed), ReplyMatch::kNo) << "a good frame of another encoder";
  EXPECT_EQ(Match("FF 81 FF FF FF FF 7A", {.bits = 26}), ReplyMatch::kDamaged);
  EXPECT_EQ(Match("FF 81 08 00 00 00 88", {.bits = 26}), ReplyMatch::kYes) << "the resolution is its content";
}

TEST(SaaCodec, AFrameWithoutOneByteIsNearlyItsReply) {
  const Format fixed{.bits = 14};
  EXPECT_EQ(Match("FF 81 12 34", fixed), ReplyMatch::kNearly);
  EXPECT_EQ(Match("FF 12 34 C6", fixed), ReplyMatch::kNearly);
  EXPECT_EQ(Match("81 12 34 C6", fixed), ReplyMatch::kNearly) << "the start is missing";
  EXPECT_EQ(Match("12 34 C6 00", fixed), ReplyMatch::kNo);
  EXPECT_EQ(Match("12 81 34 C6", fixed), ReplyMatch::kNo);
  EXPECT_EQ(Match("FF 81 12", fixed), ReplyMatch::kNo) << "two bytes are missing";
  EXPECT_EQ(Match("FF 81 12 34 C6 00", fixed), ReplyMatch::kNo);
  EXPECT_EQ(Match("0A 12 34 C6", {.bits = 14, .header = ReplyHeader::kAddress, .address = 0x0A}, 0x0A),
            ReplyMatch::kNearly);
}

TEST(SaaCodec, TheRequestNamesTheAddressOfItsReply) {
  const Format address{.bits = 14, .header = ReplyHeader::kAddress, .address = 0x0A};
  EXPECT_EQ(Match("FF 0A 12 34 4F", address, 0x0A), ReplyMatch::kYes);
  EXPECT_EQ(Match("FF 0A 12 34 50", address, 0x0A), ReplyMatch::kDamaged);
  EXPECT_EQ(Match("FF 81 12 34 C7", address, 0x0A), ReplyMatch::kNo) << "81 is four bits away";
  const Format either{.bits = 14, .header = ReplyHeader::kEither, .address = 0x0A};
  EXPECT_EQ(Match("FF 81 12 34 C7", either, 0x0A), ReplyMatch::kDamaged);
  EXPECT_EQ(Match("FF 0A 12 34 50", either, 0x0A), ReplyMatch::kDamaged);
  EXPECT_EQ(Match("FF 81 12 34 C6", either, 0x0A), ReplyMatch::kYes);
  EXPECT_EQ(Match("FF 0A 12 34 50", {.bits = 14}), ReplyMatch::kNo) << "a fixed header has no address";
}

}  // namespace
}  // namespace axlecast::saa_serial
