// What the static checks of a reply do to damaged ones.
#include <gtest/gtest.h>

#include <random>
#include <vector>

#include "drivers/tformat/codec.h"

namespace axlecast::tformat {
namespace {

using Vector = std::vector<std::uint8_t>;

// TS5669 spec 6.3.4 done naively: the message's bits in the order of the wire (LSB first) are a polynomial, first
// bit highest; eight zeros are appended and the remainder of the division by X^8 + 1 is the CRC, highest term
// first.
std::uint8_t CrcByDivision(const Vector& bytes) {
  std::vector<int> bits;
  for (const std::uint8_t byte : bytes) {
    for (unsigned i = 0; i < 8; ++i) bits.push_back(static_cast<int>(byte >> i & 1U));
  }
  const std::size_t message = bits.size();
  bits.resize(message + 8, 0);
  const std::vector<int> divisor = {1, 0, 0, 0, 0, 0, 0, 0, 1};
  for (std::size_t i = 0; i < message; ++i) {
    if (bits[i] == 0) continue;
    for (std::size_t j = 0; j < divisor.size(); ++j) bits[i + j] ^= divisor[j];
  }
  unsigned crc = 0;
  for (std::size_t i = 0; i < 8; ++i) crc |= static_cast<unsigned>(bits[message + i]) << i;  // sent LSB first
  return static_cast<std::uint8_t>(crc);
}

TEST(CodecDamage, CrcIsTheRemainderOfTheDivision) {
  // Last bytes of public captures, see golden/captures.txt.
  EXPECT_EQ(CrcByDivision({0x02, 0x20, 0x6E, 0xC3, 0x58}), 0xD7);
  EXPECT_EQ(CrcByDivision({0x1A, 0x00, 0xA5, 0xA5, 0x00, 0x17, 0x88, 0x88, 0x00, 0x00}), 0x0D);
  std::mt19937 random(5669);
  for (int round = 0; round < 20'000; ++round) {
    Vector bytes(random() % 12);
    for (std::uint8_t& byte : bytes) byte = static_cast<std::uint8_t>(random());
    ASSERT_EQ(Crc(bytes), CrcByDivision(bytes));
  }
}

// Good replies to `field`, by the layout of Table 2: edges first, then random ones.
std::vector<Vector> GoodReplies(std::uint8_t field) {
  std::vector<Vector> replies;
  std::mt19937 random(17 + field);
  for (unsigned round = 0; round < 300; ++round) {
    const unsigned mask = round == 0 ? 0U : round == 1 ? ~0U : static_cast<unsigned>(random());
    const unsigned position = mask & 0x1FFFFU;
    const unsigned turns = (round < 2 ? mask : static_cast<unsigned>(random())) & 0xFFFFU;
    const unsigned alarms = (round < 2 ? mask : static_cast<unsigned>(random())) & 0xEFU;
    const auto byte = [](unsigned value) { return static_cast<std::uint8_t>(value); };
    Vector reply = {field, byte(alarms & 0x30U)};
    if (field != 0x8A) reply.insert(reply.end(), {byte(position), byte(position >> 8U), byte(position >> 16U)});
    if (field == 0x1A) reply.push_back(0x11);
    if (field != 0x02) reply.insert(reply.end(), {byte(turns), byte(turns >> 8U), 0});
    if (field == 0x1A) reply.push_back(byte(alarms));
    reply.push_back(CrcByDivision(reply));
    replies.push_back(reply);
  }
  return replies;
}

class SingleBit : public testing::TestWithParam<std::uint8_t> {};

// Every single-bit flip of a reply is either detected or cannot change the position.
TEST_P(SingleBit, FlipIsDetectedOrHarmless) {
  const Vector request = {GetParam()};
  for (const Vector& good : GoodReplies(GetParam())) {
    const Reply truth = ParseReply(request, good, Format{});
    ASSERT_EQ(truth.error, ReplyError::kNone);
    for (std::size_t bit = 0; bit < 8 * good.size(); ++bit) {
      Vector damaged = good;
      damaged[bit / 8] ^= static_cast<std::uint8_t>(1U << bit % 8);
      const Reply reply = ParseReply(request, damaged, Format{});
      if (reply.error != ReplyError::kNone) continue;
      EXPECT_EQ(reply.single_turn, truth.single_turn) << bit;
      EXPECT_EQ(reply.multi_turn, truth.multi_turn) << bit;
    }
  }
}

// A lost byte and a byte too many change the length, which alone is enough.
TEST_P(SingleBit, LostAndInsertedBytesAreDetected) {
  const Vector request = {GetParam()};
  for (const Vector& good : GoodReplies(GetParam())) {
    for (std::size_t at = 0; at < good.size(); ++at) {
      Vector lost = good;
      lost.erase(lost.begin() + static_cast<std::ptrdiff_t>(at));
      EXPECT_EQ(ParseReply(request, lost, Format{}).error, ReplyError::kShort);
      Vector doubled = good;
      doubled.insert(doubled.begin() + static_cast<std::ptrdiff_t>(at), good[at]);
      EXPECT_EQ(ParseReply(request, doubled, Format{}).error, ReplyError::kLong);
    }
  }
}

INSTANTIATE_TEST_SUITE_P(Readouts, SingleBit,
                         testing::Values(std::uint8_t{0x02}, std::uint8_t{0x8A}, std::uint8_t{0x1A}));

// Known weakness of X^8 + 1, so that nobody takes the CRC for more than it is: swapped bytes and two flips of one
// bit position pass it. The later checks: echo, always-zero bits, ENID, plausibility.
TEST(CodecDamage, CrcMissesSwappedBytesAndPairedFlips) {
  EXPECT_EQ(Crc(Vector{0x02, 0x00, 0x12, 0x34, 0x01}), Crc(Vector{0x02, 0x00, 0x34, 0x12, 0x01}));
  EXPECT_EQ(Crc(Vector{0x02, 0x00, 0x12, 0x34, 0x01}), Crc(Vector{0x02, 0x00, 0x13, 0x35, 0x01}));
  // A paired flip within the always-zero bits is caught by them, one within the echo by the echo.
  const Vector request = {0x1A};
  Vector zeros = {0x1A, 0, 0, 0, 0x80, 0x11, 0, 0, 0x80, 0, 0x0B};
  EXPECT_EQ(ParseReply(request, zeros, Format{}).error, ReplyError::kRange);
  Vector echo = {0x1B, 0, 1, 0, 0, 0x11, 0, 0, 0, 0, 0x0B};
  EXPECT_EQ(ParseReply(request, echo, Format{}).error, ReplyError::kWrongEcho);
}

// Whatever comes, an error gives no reading: only the two outcomes that hold ID 3's data for its alarms fill it in.
TEST(CodecDamage, RandomBytesNeverGiveAFieldWithAnError) {
  const std::array<Vector, 9> requests = {
      {{0x02}, {0x8A}, {0x92}, {0x1A}, {0xBA}, {0xC2}, {0x62}, {0xEA, 0x05, 0xEF}, {0x32, 0x05, 0x0F, 0x38}}};
  std::mt19937 random(42);
  for (int round = 0; round < 200'000; ++round) {
    const Vector& request = requests[random() % requests.size()];
    Vector bytes(random() % 14);
    for (std::uint8_t& byte : bytes) byte = static_cast<std::uint8_t>(random());
    if (!bytes.empty() && random() % 2 == 0) bytes[0] = request[0];
    const Reply reply = ParseReply(request, bytes, Format{});
    const bool may_hold = reply.error == ReplyError::kNone || reply.error == ReplyError::kAbnormalReply ||
                          reply.error == ReplyError::kCommunicationAlarm;
    ASSERT_TRUE(may_hold || !(reply.status || reply.single_turn || reply.multi_turn || reply.encoder_id ||
                              reply.alarms || reply.address || reply.busy || reply.data));
  }
}

}  // namespace
}  // namespace axlecast::tformat
