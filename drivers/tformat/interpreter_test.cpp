#include "drivers/tformat/family.h"

#include <gmock/gmock.h>

#include <axlecast/alarm_entry_t.hpp>
#include <string>
#include <vector>

#include "drivers/tformat/codec.h"
#include "drivers/tformat/device_test_support.h"

namespace axlecast::tformat {
namespace {

struct Flag {
  std::uint8_t bit;
  const char* name;
  bool latched;  // spec 6.4: "(Latched)" or "(Non-latched)"
  std::uint8_t severity;
  std::vector<const char*> action;  // what spec 6.4 and 9 order, in the words of ours
};
// Spec 6.3.3, Table 3, and 6.4, column "Action":
// OS "Reset error"; 5.4.2, note 5: the turns may be wrong, "reset is needed".
// FS "Make the rotational speed slow down to less than 100 min-1, and wait until the flag is automatically released".
// CE "Stop the servo system immediately"; "Turn off and on the power supply".
// OF "Reset error": the counter continues as a cyclic one, 0 to 65,535.
// ME "Return to the origin position. Reset error."
// BE "Reset error and multi-turn data"; "It is necessary to check or replace the external battery".
// BA "Error status is automatically released"; "It is necessary to check or replace the external battery".
const Flag kFlags[] = {
    {0x01, "over_speed", true, alarm_entry_t::SEVERITY_ERROR, {"Turns may be wrong", "reset turns and errors"}},
    {0x02,
     "full_absolute_status",
     false,
     alarm_entry_t::SEVERITY_WARNING,
     {"slow down below 100 rpm", "wait until it clears itself"}},
    {0x04,
     "counting_error",
     false,
     alarm_entry_t::SEVERITY_CRITICAL,
     {"Stop the servo system at once", "turn the power off and on"}},
    {0x08, "counter_overflow", true, alarm_entry_t::SEVERITY_WARNING, {"65535", "clear the errors"}},
    {0x20,
     "multi_turn_error",
     true,
     alarm_entry_t::SEVERITY_ERROR,
     {"Return to the origin position", "reset turns and errors"}},
    {0x40,
     "battery_error",
     true,
     alarm_entry_t::SEVERITY_ERROR,
     {"Check or replace the battery", "reset turns and errors"}},
    {0x80,
     "battery_alarm",
     false,
     alarm_entry_t::SEVERITY_WARNING,
     {"Check or replace the battery", "clears itself"}}};

AllFields With(std::uint8_t alarms) { return {.alarms = alarms}; }

// What an operator sees when the encoder raises a flag; it fits alarm_entry_t.
TEST(Alarms, TellWhatTheSpecOrdersForEachFlag) {
  for (const Flag& flag : kFlags) {
    DeviceFixture bench;
    bench.GoOnline(With(flag.bit));
    ASSERT_TRUE(bench.output.alarm_specs.contains(flag.name)) << flag.name;
    const AlarmSpec& alarm = bench.output.alarm_specs.at(flag.name);
    EXPECT_EQ(1 << (alarm.code - 0x100), flag.bit) << flag.name;
    EXPECT_EQ(alarm.source, alarm_entry_t::SOURCE_DEVICE);
    EXPECT_EQ(alarm.severity, flag.severity) << flag.name;
    for (const char* part : flag.action)
      EXPECT_THAT(std::string(alarm.action), testing::HasSubstr(part)) << flag.name;
    EXPECT_LE(std::string(alarm.name).size(), 24u);
    EXPECT_LE(std::string(alarm.action).size(), 80u);
  }
  EXPECT_EQ(DeviceAlarms().size(), std::size(kFlags));
}

// Spec 6.3.2 (4), and an encoder that is another one than the file's.
TEST(Alarms, OfTheDriverTellWhatToDo) {
  DeviceFixture bench;
  bench.GoOnline();
  bench.Give(kId3, All({.status = 0x40}));
  EXPECT_THAT(std::string(bench.output.alarm_specs.at("communication_alarm").action),
              testing::HasSubstr("check cable, shield and termination"));
  bench.Give(kId3, All(), false);
  for (int i = 0; i < 3; ++i) bench.Give(kId3, All({.encoder_id = 0x17}), i != 1);
  const AlarmSpec& wrong = bench.output.alarm_specs.at("wrong_identity");
  EXPECT_THAT(std::string(wrong.action), testing::HasSubstr("check cables and configuration"));
  EXPECT_EQ(wrong.severity, alarm_entry_t::SEVERITY_CRITICAL);
}

TEST(Interpreter, ReportsEachAlarmLiveOrLatchedAndItsEnd) {
  for (const Flag& flag : kFlags) {
    DeviceFixture bench;
    bench.GoOnline();
    EXPECT_FALSE(bench.output.Present(flag.name));
    bench.Give(kId3, All(With(flag.bit)));
    EXPECT_FALSE(bench.output.Present(flag.name)) << "one reply that passed the checksum by chance";
    bench.Give(kId3, All(With(flag.bit)), false);
    EXPECT_EQ(bench.output.alarms[flag.name], flag.latched ? AlarmState::kDeviceLatched : AlarmState::kLive);
    bench.Give(kId3, All());
    bench.Give(kId3, All(), false);
    EXPECT_EQ(bench.output.alarms[flag.name], AlarmState::kAbsent);
  }
}

TEST(Interpreter, PutsEachFlagsMeaningIntoTheSample) {
  for (const Flag& flag : kFlags) {
    DeviceFixture bench;
    bench.GoOnline();
    bench.Give(kId3, All(With(flag.bit)));
    const Sample& sample = bench.output.samples.back();
    EXPECT_EQ(sample.error, flag.bit == 0x04) << flag.name;
    EXPECT_EQ(sample.low_accuracy, flag.bit == 0x02);
    EXPECT_EQ(sample.turns_trusted, (flag.bit & 0x61) == 0);
    EXPECT_EQ(sample.turns_wrapped, flag.bit == 0x08);
    EXPECT_EQ(sample.warning, flag.bit == 0x80);
    EXPECT_EQ(sample.device_status, StatusFor(flag.bit) | flag.bit << 8);
  }
}

TEST(Interpreter, LosesTheReferenceOnBatteryMultiTurnAndOverSpeedErrorsOnly) {
  for (const Flag& flag : kFlags) {
    DeviceFixture bench;
    bench.GoOnline();
    bench.Give(kId3, All(With(flag.bit)));
    EXPECT_EQ(bench.output.references_lost, 0);
    bench.Give(kId3, All(With(flag.bit)), false);
    bench.Give(kId3, All(With(flag.bit)));
    EXPECT_EQ(bench.output.references_lost, (flag.bit & 0x61) != 0 ? 1 : 0) << flag.name;
    bench.Give(kId3, All());
    bench.Give(kId3, All(), false);
    EXPECT_EQ(bench.output.references_restored, 0) << "cleared flags restore nothing";
    bench.Give(kId3, All(With(flag.bit)));
    bench.Give(kId3, All(With(flag.bit)), false);
    EXPECT_EQ(bench.output.references_lost, (flag.bit & 0x61) != 0 ? 2 : 0) << "a second occurrence";
  }
}

TEST(Interpreter, CarriesTheAlarmsOfId3OnToId0) {
  DeviceFixture bench("{model: ts5669n127, plan: id0, id3_every: 100}");
  bench.GoOnline(With(0x42));  // BE and FS
  bench.Give(kId0, Short(kId0, 9, 0x20));
  const Sample& sample = bench.output.samples.back();
  EXPECT_EQ(sample.counts, 9);
  EXPECT_TRUE(sample.low_accuracy);
  EXPECT_FALSE(sample.turns_trusted);
  EXPECT_EQ(sample.device_status, 0x4220);
}

TEST(Interpreter, WithoutABatteryItIsASingleTurnEncoder) {
  DeviceFixture bench("{model: ts5669n127, battery: false}");
  EXPECT_EQ(bench.settings().turns_range, 0);
  bench.GoOnline(With(0xE9));
  const Sample& sample = bench.output.samples.back();
  EXPECT_FALSE(sample.has_turns);
  EXPECT_EQ(sample.turns, 0);
  EXPECT_TRUE(sample.turns_trusted);
  EXPECT_FALSE(sample.warning);
  EXPECT_EQ(bench.output.references_lost, 0);
  EXPECT_FALSE(bench.output.Present("battery_error"));
  EXPECT_EQ(sample.device_status, 0xE920) << "raw stays raw";
}

TEST(Interpreter, AnotherEncoderMustSayItThreeTimes) {
  DeviceFixture bench;
  bench.GoOnline();
  EXPECT_EQ(bench.output.identities, (std::vector<std::int64_t>{0x11}));
  bench.Give(kId3, All({.encoder_id = 0x17}));
  bench.Give(kId3, All({.encoder_id = 0x17}), false);
  EXPECT_TRUE(bench.output.refusals.empty());
  bench.Give(kId3, All({.encoder_id = 0x17}));
  ASSERT_EQ(bench.output.refusals.size(), 1u);
  EXPECT_NE(bench.output.refusals[0].find("0x17"), std::string::npos);
  EXPECT_TRUE(bench.output.Present("wrong_identity"));
  EXPECT_EQ(bench.output.errors[ErrorKind::kWrongIdentity], 3);
  const std::size_t samples = bench.output.samples.size();
  bench.Give(kId3, All());
  EXPECT_FALSE(bench.output.Present("wrong_identity"));
  EXPECT_EQ(bench.output.samples.size(), samples + 1);
  EXPECT_EQ(bench.output.jumps, 1) << "an exchanged encoder is a jump without motion";
}

TEST(Interpreter, NamesAnotherModelAlsoWhenItsBitsDoNotFit) {
  DeviceFixture bench;
  bench.LinkUp();
  bench.PassSilence();
  for (int i = 0; i < 3; ++i) bench.Give(kId3, All({.single_turn = 0x7FFFFF, .encoder_id = 0x17}));
  EXPECT_EQ(bench.output.refusals.size(), 1u);
  EXPECT_EQ(bench.output.errors[ErrorKind::kRange], 0);
  EXPECT_TRUE(bench.output.samples.empty());
}

constexpr const char* kTagged = "{model: ts5669n127, identity: {eeprom_address: 72, bytes: \"A1 05\"}}";

void ReadTag(DeviceFixture& bench, std::uint8_t first, std::uint8_t second) {
  bench.Give(Checked({0xEA, 72}), Cell(72, first), false);
  bench.Give(Checked({0xEA, 73}), Cell(73, second), false);
}

TEST(Interpreter, PublishesNothingBeforeTheTagIsRead) {
  DeviceFixture bench(kTagged);
  bench.LinkUp();
  bench.PassSilence();
  bench.Give(kId3, All());
  EXPECT_TRUE(bench.output.samples.empty());
  ReadTag(bench, 0xA1, 0x05);
  bench.Give(kId3, All());
  EXPECT_EQ(bench.output.samples.size(), 1u);
  EXPECT_EQ(bench.output.AllErrors(), 0);
}

// Spec 6.3.2 (3): ea0 is CE, and ea1 is ME, BE or BA. Two inverted bits of one column pass the checksum, one of them in SF or
// ALMC and the other in the position.
TEST(Interpreter, RefusesAReplyWhoseStatusAndAlarmsContradictEachOther) {
  for (const AllFields& fields : {AllFields{.single_turn = 32, .status = 0x20},
                                  {.single_turn = 32, .alarms = 0x20, .status = 0},
                                  {.single_turn = 16, .status = 0x10},
                                  {.single_turn = 4, .alarms = 0x04, .status = 0}}) {
    DeviceFixture bench;
    bench.GoOnline({.single_turn = 0});
    const std::size_t samples = bench.output.samples.size();
    bench.Give(kId3, All(fields));
    EXPECT_EQ(bench.output.samples.size(), samples);
    EXPECT_EQ(bench.output.errors[ErrorKind::kRange], 1);
    bench.Give(kId3, All({.single_turn = 0}), false);  // asked again at once
    EXPECT_EQ(bench.output.samples.size(), samples + 1);
    EXPECT_EQ(bench.output.AllErrors(), 1);
  }
}

// Whether an encoder changes SF and ALMC in the same reply is not documented.
TEST(Interpreter, BelievesAContradictionOfStatusAndAlarmsThatStays) {
  DeviceFixture bench;
  bench.GoOnline();
  const std::size_t samples = bench.output.samples.size();
  for (int i = 0; i < 4; ++i) bench.Give(kId3, All({.alarms = 0x80, .status = 0}), i != 1);
  EXPECT_EQ(bench.output.samples.size(), samples + 3);
  EXPECT_EQ(bench.output.errors[ErrorKind::kRange], 1);
  EXPECT_TRUE(bench.output.Present("battery_alarm"));
}

TEST(Interpreter, RefusesAnotherUnitOfTheSameModelByItsTag) {
  DeviceFixture bench(kTagged);
  bench.LinkUp();
  bench.PassSilence();
  bench.Give(kId3, All());
  for (int i = 0; i < 3; ++i) ReadTag(bench, 0xA1, 0x06);
  ASSERT_EQ(bench.output.refusals.size(), 1u);
  EXPECT_NE(bench.output.refusals[0].find("A1 06"), std::string::npos);
  EXPECT_TRUE(bench.output.Present("wrong_identity"));
  bench.Give(kId3, All());
  EXPECT_TRUE(bench.output.samples.empty());
  EXPECT_EQ(bench.output.errors[ErrorKind::kWrongIdentity], 1);
  bench.now += 1 * kSecond;  // it is looked at again once a second
  bench.Give(kId3, All());
  ReadTag(bench, 0xA1, 0x05);
  EXPECT_FALSE(bench.output.Present("wrong_identity"));
  bench.Give(kId3, All());
  EXPECT_EQ(bench.output.samples.size(), 1u);
}

TEST(Interpreter, WaitsForATagThatIsBusyAndReadsItAgainAfterALostLink) {
  DeviceFixture bench(kTagged);
  bench.LinkUp();
  bench.PassSilence();
  bench.Give(kId3, All());
  bench.Give(Checked({0xEA, 72}), CellBusy(72), false);
  EXPECT_TRUE(bench.IsIdle(false));
  bench.now += 2 * kMillisecond;
  ReadTag(bench, 0xA1, 0x05);
  bench.LinkDown();
  bench.LinkUp();
  bench.PassSilence();
  bench.Give(kId3, All());
  EXPECT_TRUE(bench.output.samples.empty());
  ReadTag(bench, 0xA1, 0x05);
}

TEST(Interpreter, ChecksTheTagAgainAfterTheEncoderWasGone) {
  DeviceFixture bench(kTagged);
  bench.LinkUp();
  bench.PassSilence();
  bench.Give(kId3, All());
  ReadTag(bench, 0xA1, 0x05);
  bench.Give(kId3, All());
  for (int i = 0; i < 2; ++i) {
    bench.Give(kId3, {});
    bench.PassSilence();
  }
  const std::size_t samples = bench.output.samples.size();
  bench.Give(kId3, All());
  EXPECT_EQ(bench.output.samples.size(), samples);
  EXPECT_EQ(bench.Offered(false), Checked({0xEA, 72}));
}

}  // namespace
}  // namespace axlecast::tformat
