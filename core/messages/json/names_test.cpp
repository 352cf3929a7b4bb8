#include "core/messages/json/names.h"

#include <gtest/gtest.h>

#include <axlecast/alarm_entry_t.hpp>
#include <axlecast/bus_health_t.hpp>
#include <axlecast/device_info_t.hpp>
#include <axlecast/position_t.hpp>

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

}  // namespace
}  // namespace axlecast
