#include "drivers/runtime/command/command_words.h"

#include <gtest/gtest.h>

#include <axlecast/command_status_t.hpp>

namespace axlecast {
namespace {

TEST(CommandWords, NameTheConstants) {
  EXPECT_EQ(StateName(command_status_t::STATE_UNKNOWN), "unknown");
  EXPECT_EQ(StateName(command_status_t::STATE_INDETERMINATE), "indeterminate");
  EXPECT_EQ(ReasonName(command_status_t::REASON_NOT_STANDING_STILL), "not_standing_still");
  EXPECT_EQ(ReasonName(command_status_t::REASON_FENCED), "fenced");
  EXPECT_EQ(FindingName(command_status_t::FINDING_NO_EFFECT_SEEN), "no_effect_seen");
  EXPECT_EQ(StateName(-1), "unknown");
  EXPECT_EQ(ReasonName(1'000), "unknown");
}

TEST(CommandWords, FindingOfAnyOtherWordIsCannotTell) {
  EXPECT_EQ(FindingOf("effect_seen"), command_status_t::FINDING_EFFECT_SEEN);
  EXPECT_EQ(FindingOf("no_effect_seen"), command_status_t::FINDING_NO_EFFECT_SEEN);
  EXPECT_EQ(FindingOf("maybe"), command_status_t::FINDING_CANNOT_TELL);
  EXPECT_EQ(FindingOf("none"), command_status_t::FINDING_CANNOT_TELL);
}

TEST(CommandWords, IdsAreThirtyTwoHexDigits) {
  const auto id = ParseId("00112233445566778899AAbbccddeeff");
  ASSERT_TRUE(id);
  EXPECT_EQ(IdText(*id), "00112233445566778899aabbccddeeff");
  EXPECT_FALSE(ParseId("00112233445566778899aabbccddeef"));
  EXPECT_FALSE(ParseId("00112233445566778899aabbccddeefg"));
}

}  // namespace
}  // namespace axlecast
