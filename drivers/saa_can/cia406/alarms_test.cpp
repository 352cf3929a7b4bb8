#include "drivers/saa_can/cia406/alarms.h"

#include <gmock/gmock.h>

#include <cstring>
#include <set>

#include "drivers/saa_can/cia406/node_alarms.h"
#include "drivers/saa_can/cia406/objects.h"
#include "tests/support/recording_output.h"

namespace axlecast::saa_can::cia406 {
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

TEST_F(Cia406Alarms, EveryBitIsExactlyOneAlarmWithAFittingText) {
  std::set<std::int32_t> codes;
  for (const auto table : {Alarms(), Warnings()}) {
    unsigned seen = 0;
    for (const DiagnosticAlarm& alarm : table) {
      EXPECT_EQ(seen & alarm.bits, 0U) << alarm.spec.name;
      seen |= alarm.bits;
      EXPECT_TRUE(codes.insert(alarm.spec.code).second) << alarm.spec.name;
      EXPECT_LE(std::strlen(alarm.spec.name), 24U);
      EXPECT_LE(std::strlen(alarm.spec.action), 80U) << alarm.spec.name;
    }
    EXPECT_EQ(seen, 0xFFFFU);
  }
  for (const AlarmSpec& alarm :
       {kWrongEncoder, kHeartbeatLost, kNotOperational, kSecondSync, kPeriodDiffers, kMoreEmergencies}) {
    EXPECT_TRUE(codes.insert(alarm.code).second) << alarm.name;
    EXPECT_LE(std::strlen(alarm.name), 24U);
    EXPECT_LE(std::strlen(alarm.action), 80U) << alarm.name;
  }
  for (unsigned upper = 0; upper < 256; ++upper) {
    const AlarmSpec alarm = EmergencyAlarm(static_cast<std::uint16_t>(upper << 8));
    EXPECT_LE(std::strlen(alarm.name), 24U);
    EXPECT_LE(std::strlen(alarm.action), 80U);
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

// CiA 301 7.2.7.1: 0000h with a register that is not 0 says that other errors are left.
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
}  // namespace axlecast::saa_can::cia406
