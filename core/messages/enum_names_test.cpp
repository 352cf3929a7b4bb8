#include "core/messages/enum_names.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <axlecast/alarm_entry_t.hpp>
#include <axlecast/bus_health_t.hpp>
#include <axlecast/command_status_t.hpp>
#include <axlecast/device_info_t.hpp>
#include <axlecast/position_t.hpp>
#include <string>
#include <vector>

namespace axlecast {
namespace {

TEST(Names, FollowTheMessagesConstants) {
  EXPECT_EQ(UnitName(position_t::UNIT_COUNT), "count");
  EXPECT_EQ(UnitName(position_t::UNIT_INCH), "inch");
  EXPECT_EQ(DeviceStateName(device_info_t::STATE_OFFLINE), "OFFLINE");
  EXPECT_EQ(BusStateName(bus_health_t::STATE_UP), "UP");
  EXPECT_EQ(AlarmStateName(alarm_entry_t::STATE_DRIVER_LATCHED), "driver_latched");
  EXPECT_EQ(SeverityName(alarm_entry_t::SEVERITY_CRITICAL), "critical");
}

TEST(Names, UnknownNumbers) {
  EXPECT_EQ(UnitName(-1), "?");
  EXPECT_EQ(UnitName(100), "?");
}

TEST(Names, Flags) {
  EXPECT_EQ(FlagNames(0), "");
  EXPECT_EQ(FlagNames(std::int32_t{position_t::FLAG_VALID} | position_t::FLAG_TURNS_COUNTED_BY_DRIVER),
            "valid,turns_counted_by_driver");
  EXPECT_EQ(FlagNames(position_t::FLAG_REDECODED), "redecoded");
  EXPECT_EQ(FlagNames(position_t::FLAG_SIMULATED | 0x100000), "simulated,0x100000");
}

TEST(Names, ErrorsByKind) {
  device_info_t info{};
  EXPECT_EQ(ErrorCounts(info.errors), "");
  info.errors[device_info_t::ERROR_WRONG_ECHO] = 2;
  info.errors[device_info_t::ERROR_SILENT] = 1;
  EXPECT_EQ(ErrorCounts(info.errors), "wrong_echo 2, silent 1");
}

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

}  // namespace

}  // namespace axlecast
