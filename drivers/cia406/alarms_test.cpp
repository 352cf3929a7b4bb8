#include "drivers/cia406/alarms.h"

#include <gmock/gmock.h>

#include <array>
#include <cstring>
#include <set>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "drivers/protocol/canopen/canopen.h"
#include "tests/support/recording_output.h"

namespace axlecast::cia406 {
namespace {

using ::testing::ElementsAre;
using ::testing::IsEmpty;
using ::testing::Pair;

class Cia406Alarms : public testing::Test {
 protected:
  void Emergency(std::uint16_t code, std::uint8_t error_register) {
    alarms_.OnEmergency({.code = code, .error_register = error_register, .specific = {}}, 0);
  }
  std::vector<std::pair<std::int32_t, AlarmState>> Told() { return std::exchange(output_.alarms, {}); }

  RecordingOutput output_;
  NodeAlarms alarms_{output_};
};

// 6503h and 6505h, bit by bit, as the manuals that README.md cites name them.
TEST_F(Cia406Alarms, EachBitHasTheNameOfItsDocument) {
  const auto named = [](std::span<const DiagnosticAlarm> table, unsigned bit) {
    std::string names;
    for (const DiagnosticAlarm& alarm : table) {
      if ((alarm.bits >> bit & 1U) != 0) names += alarm.spec.name;
    }
    return names;
  };
  const std::array<const char*, 16> alarms = {
      "position_error",        "commissioning_error",   "reserved_alarm",        "reserved_alarm",
      "reserved_alarm",        "reserved_alarm",        "reserved_alarm",        "reserved_alarm",
      "reserved_alarm",        "reserved_alarm",        "reserved_alarm",        "reserved_alarm",
      "manufacturer_alarm_12", "manufacturer_alarm_13", "manufacturer_alarm_14", "manufacturer_alarm_15"};
  const std::array<const char*, 16> warnings = {
      "frequency_exceeded",   "light_control_reserve", "cpu_watchdog",         "operating_time_limit",
      "battery_charge",       "reference_not_reached", "reserved_warning",     "reserved_warning",
      "reserved_warning",     "reserved_warning",      "reserved_warning",     "reserved_warning",
      "manufacturer_warning", "manufacturer_warning",  "manufacturer_warning", "manufacturer_warning"};
  for (unsigned bit = 0; bit < 16; ++bit) {
    EXPECT_EQ(named(kAlarmTable, bit), alarms.at(bit)) << bit;
    EXPECT_EQ(named(kWarningTable, bit), warnings.at(bit)) << bit;
  }
}

// CiA 301 7.2.7, table 26, by the upper byte of the error code.
TEST_F(Cia406Alarms, AnEmergencyHasTheNameOfItsClass) {
  const std::pair<std::uint16_t, const char*> codes[] = {{0x1000, "emergency_generic"},
                                                         {0x2000, "emergency_current"},
                                                         {0x2300, "emergency_current"},
                                                         {0x3000, "emergency_voltage"},
                                                         {0x3100, "emergency_voltage"},
                                                         {0x4000, "emergency_temperature"},
                                                         {0x4200, "emergency_temperature"},
                                                         {0x5000, "emergency_hardware"},
                                                         {0x6000, "emergency_software"},
                                                         {0x6300, "emergency_software"},
                                                         {0x7000, "emergency_module"},
                                                         {0x8000, "emergency_monitoring"},
                                                         {0x8110, "emergency_communication"},
                                                         {0x8210, "emergency_communication"},
                                                         {0x9000, "emergency_external"},
                                                         {0xFF00, "emergency_device"},
                                                         {0xA000, "emergency"}};
  for (const auto& [code, name] : codes) {
    const AlarmSpec alarm = EmergencyAlarm(code);
    EXPECT_STREQ(alarm.name, name) << code;
    EXPECT_EQ(alarm.code, 0x10000 + code);
  }
}

// alarm_entry_t: 24 and 80 bytes.
TEST_F(Cia406Alarms, EveryTextFitsItsMessageAndEveryCodeIsUsedOnce) {
  std::vector<AlarmSpec> all = {kWrongEncoder, kHeartbeatLost, kNotOperational,
                                kSecondSync,   kPeriodDiffers, kMoreEmergencies};
  for (const DiagnosticAlarm& alarm : kAlarmTable) all.push_back(alarm.spec);
  for (const DiagnosticAlarm& alarm : kWarningTable) all.push_back(alarm.spec);
  for (unsigned upper = 0; upper < 256; ++upper) {
    all.push_back(EmergencyAlarm(static_cast<std::uint16_t>(upper << 8)));
  }
  std::set<std::int32_t> codes;
  for (const AlarmSpec& alarm : all) {
    EXPECT_TRUE(codes.insert(alarm.code).second) << alarm.name;
    EXPECT_LE(std::strlen(alarm.name), 24U);
    EXPECT_LE(std::strlen(alarm.action), 80U) << alarm.name;
  }
}

TEST_F(Cia406Alarms, AreToldWhenTheyChange) {
  alarms_.OnAlarms(0x0001, 0);
  EXPECT_THAT(Told(), ElementsAre(Pair(0x120, AlarmState::kLive)));
  EXPECT_TRUE(alarms_.position_error());
  alarms_.OnAlarms(0x0001, 1);
  EXPECT_THAT(Told(), IsEmpty());
  alarms_.OnAlarms(0x0004, 2);
  EXPECT_THAT(Told(), ElementsAre(Pair(0x120, AlarmState::kAbsent), Pair(0x122, AlarmState::kLive)));
  EXPECT_FALSE(alarms_.position_error());
}

// CiA 301 7.2.7.1: 0000h with a register that is not 0 means that other errors remain.
TEST_F(Cia406Alarms, AnErrorResetEndsWhatTheRegisterNoLongerNames) {
  Emergency(0x3110, 0x05);
  Emergency(0x4210, 0x0D);
  EXPECT_EQ(Told().size(), 2U);
  Emergency(0x0000, 0x09);
  EXPECT_THAT(Told(), ElementsAre(Pair(0x13110, AlarmState::kAbsent)));
  Emergency(0x0000, 0x00);
  EXPECT_THAT(Told(), ElementsAre(Pair(0x14210, AlarmState::kAbsent)));
}

TEST_F(Cia406Alarms, TheSameCodeAgainIsOneAlarm) {
  Emergency(0x5000, 0x81);
  Emergency(0x5000, 0x81);
  EXPECT_THAT(Told(), ElementsAre(Pair(0x15000, AlarmState::kLive)));
}

TEST_F(Cia406Alarms, NoMoreThanEightCodesAtATime) {
  for (std::uint16_t code = 0xFF00; code < 0xFF20; ++code) Emergency(code, 0x01);
  const auto told = Told();
  EXPECT_EQ(told.size(), 9U);
  EXPECT_EQ(told.back(), (std::pair{0x145, AlarmState::kLive}));
  Emergency(0x0000, 0x00);
  EXPECT_EQ(Told().size(), 9U) << "all are over";
}

TEST_F(Cia406Alarms, ABootUpEndsThem) {
  Emergency(0x5000, 0x81);
  Told();
  alarms_.OnBootUp(1);
  EXPECT_THAT(Told(), ElementsAre(Pair(0x15000, AlarmState::kAbsent)));
  EXPECT_FALSE(alarms_.last_emergency());
}

}  // namespace
}  // namespace axlecast::cia406
