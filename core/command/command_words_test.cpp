#include "core/command/command_words.h"
#include "core/command/command_id.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <axlecast/command_status_t.hpp>
#include <string>
#include <vector>

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

// lcmtypes/command_status_t.lcm appends reasons only; the first that has no word yet ends the list.
TEST(CommandWords, EveryReasonHasAWordAndIsTemporaryOrNot) {
  std::vector<std::string> temporary;
  std::vector<std::string> lasting;
  for (std::int32_t reason = 0; ReasonName(reason) != "unknown"; ++reason) {
    (IsTemporary(reason) ? temporary : lasting).emplace_back(ReasonName(reason));
  }
  EXPECT_THAT(temporary,
              testing::ElementsAre("stale_bridge", "queue_full", "busy", "driver_absent", "not_standing_still",
                                   "no_permit", "device_offline", "journal", "deadline", "stopping",
                                   "moved_during_sequence", "fenced", "bridge_restarted"));
  EXPECT_THAT(lasting, testing::ElementsAre(
                           "none", "unknown_device", "unknown_operation", "bad_argument", "id_reused", "malformed",
                           "bad_signature", "unsigned", "denied", "epoch", "device_alarm", "not_permitted", "wear",
                           "unsupported_mode", "cancelled", "no_reply", "read_back_differs", "device_refused",
                           "driver_restarted", "driver_silent", "wrong_identity", "token", "no_datum"));
  EXPECT_EQ(ReasonName(command_status_t::REASON_BRIDGE_RESTARTED), "bridge_restarted");
  EXPECT_EQ(ReasonName(command_status_t::REASON_NO_DATUM), "no_datum");
  EXPECT_FALSE(IsTemporary(-1));
  EXPECT_FALSE(IsTemporary(1'000));
}

TEST(CommandWords, FindingOfAnyOtherWordIsCannotTell) {
  EXPECT_EQ(FindingOf("reads_as_after"), command_status_t::FINDING_EFFECT_SEEN);
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
