#include "core/messages/message.h"

#include <gtest/gtest.h>

#include <axlecast/argument_t.hpp>
#include <axlecast/command_body_t.hpp>
#include <cstring>
#include <vector>

namespace axlecast {
namespace {

// LCM's encoding: 8 bytes of type, then per string a length, big-endian and with the NUL, and the characters.
constexpr std::size_t kLengthAt = 8;

TEST(DecodeMessage, NoLengthOfAStringLeadsOutsideTheMessage) {
  argument_t argument;
  argument.key = "address";
  argument.value = "72";
  const std::vector<std::uint8_t> good = Encoded(argument);
  ASSERT_EQ(good[kLengthAt + 3], 8);
  ASSERT_TRUE(DecodeMessage<argument_t>(good));
  for (const std::uint32_t length : {0x80000000U, 0x80000001U, 0xFFFFFFFFU, 0x7FFFFFFFU, 0U, 1'000U, 16U, 15U}) {
    std::vector<std::uint8_t> bad = good;
    for (std::size_t i = 0; i < 4; ++i) bad[kLengthAt + i] = static_cast<std::uint8_t>(length >> (24 - 8 * i));
    EXPECT_FALSE(DecodeMessage<argument_t>(bad)) << std::hex << length;
  }
}

TEST(DecodeMessage, NegativeCountsAndCutOrPaddedMessagesAreNone) {
  command_body_t body{};
  body.device = "axis1";
  body.n_arguments = 1;
  body.arguments = {{"address", "72"}};
  std::vector<std::uint8_t> good = Encoded(body);
  ASSERT_TRUE(DecodeMessage<command_body_t>(good));
  for (std::size_t size = 0; size < good.size(); ++size) {
    EXPECT_FALSE(DecodeMessage<command_body_t>(Bytes(good).first(size))) << size;
  }
  good.push_back(0);
  EXPECT_FALSE(DecodeMessage<command_body_t>(good));
  body.n_arguments = 0;
  body.arguments.clear();
  std::vector<std::uint8_t> bad = Encoded(body);
  // Before the reason (length 1, its NUL) and the key's id.
  bad[bad.size() - 8 - 5 - 1] = 0xFF;
  EXPECT_FALSE(DecodeMessage<command_body_t>(bad));
}

}  // namespace

}  // namespace axlecast
