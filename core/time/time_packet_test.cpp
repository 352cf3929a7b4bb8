#include "core/time/time_packet.h"

#include <gtest/gtest.h>

#include <vector>

namespace axlecast {
namespace {

// Written from the layout in the header, not by the encoder.
const std::vector<std::uint8_t> kAnswer = {'A',  'X',  'T',  '1',  2,    0,    0,    0,     // an answer
                                           1,    2,    3,    4,    5,    6,    7,    8,     // nonce
                                           0,    0,    0,    0,    0,    0,    0x10, 0,     // machine_id
                                           0xFF, 0xFF, 0xFF, 0xFF, 0xFF, 0xFF, 0xFF, 0xFE,  // base_id -2
                                           0,    0,    0,    0,    0x3B, 0x9A, 0xCA, 0x00,  // asked at 1 s
                                           0,    0,    0,    0,    0x3B, 0x9A, 0xCA, 0x0A,  // answered 10 ns later
                                           0,    0,    0,    0,    0,    0,    0,    0,    0, 0, 0, 0, 0, 0, 0, 0};
const TimePacket kPacket = {.kind = TimePacket::Kind::kAnswer,
                            .nonce = 0x0102030405060708,
                            .machine_id = 0x1000,
                            .base_id = -2,
                            .asked = kSecond,
                            .answered = kSecond + 10};

TEST(TimePacket, IsAsItsLayoutStates) {
  EXPECT_EQ(DecodedTimePacket(kAnswer), kPacket);
  const TimePacketBytes bytes = Encoded(kPacket);
  EXPECT_EQ(std::vector<std::uint8_t>(bytes.begin(), bytes.end()), kAnswer);
}

TEST(TimePacket, OtherDatagramsAreRefused) {
  for (std::size_t size = 0; size < kAnswer.size(); ++size) {
    EXPECT_FALSE(DecodedTimePacket(std::span(kAnswer).first(size))) << size;
  }
  std::vector<std::uint8_t> longer = kAnswer;
  longer.push_back(0);
  EXPECT_FALSE(DecodedTimePacket(longer));
  for (std::size_t at = 0; at < 5; ++at) {
    std::vector<std::uint8_t> changed = kAnswer;
    changed[at] ^= 0x40U;
    EXPECT_FALSE(DecodedTimePacket(changed)) << at;
  }
}

}  // namespace
}  // namespace axlecast
