#include "drivers/cia406/cia406.h"

#include <gmock/gmock.h>

#include "drivers/cia406/bench_test_support.h"

namespace axlecast::cia406 {
namespace {

using ::testing::HasSubstr;

constexpr const char* kCyclic = "node: 5, bits: 13, turn_bits: 12, period_ms: 10";
constexpr const char* kSyncMode = "node: 5, bits: 13, turn_bits: 12, transmission: sync";
constexpr const char* kPolledMode = "node: 5, bits: 13, turn_bits: 12, mode: sdo";

class Cia406DeviceTest : public BenchTest {};

TEST_F(Cia406DeviceTest, IdentifiesStartsAndReadsEachTpdo) {
  Build({kCyclic}, 0, "start_deg: 90, serial: 4711, product: 0x58, revision: 0x00020003");
  RunFor(kSecond);
  EXPECT_EQ(output().identity, 0x58);
  ASSERT_GT(output().samples.size(), 50U);
  EXPECT_TRUE(output().errors.empty());
  EXPECT_TRUE(output().refused.empty());
  const Sample& sample = output().samples.back();
  EXPECT_TRUE(sample.has_turns);
  EXPECT_EQ(sample.counts, 6144) << "clockwise rises, 90 degrees counter-clockwise are 270";
  EXPECT_EQ(sample.turns, 4095);
  EXPECT_FALSE(sample.error);
  EXPECT_EQ(nodes_->Count(0x000), 1U);
  EXPECT_EQ(node().counters().ignored, 0);
  EXPECT_EQ(node().counters().overlapping, 0);
}

TEST_F(Cia406DeviceTest, TheInstantOfATpdoIsBeforeItsArrival) {
  Build({kCyclic}, 0, "speed_rpm: 60, processing_us: 300");
  RunFor(2 * kSecond);
  ASSERT_GT(output().samples.size(), 50U);
  for (const Sample& sample : output().samples) EXPECT_EQ(sample.at.HalfWidth(), 500 * kMicrosecond);
}

TEST_F(Cia406DeviceTest, WithoutNmtStartItStaysAsItIs) {
  Build({std::string(kCyclic) + ", nmt_start: false, heartbeat_ms: 300"});
  RunFor(5 * kSecond);
  EXPECT_EQ(nodes_->Count(0x000), 0U);
  EXPECT_TRUE(output().samples.empty());
  EXPECT_EQ(AlarmOf(0x142), AlarmState::kLive) << "not_operational";
  Set("nmt", "operational");
  RunFor(kSecond);
  EXPECT_FALSE(output().samples.empty());
  EXPECT_EQ(AlarmOf(0x142), AlarmState::kAbsent);
}

TEST_F(Cia406DeviceTest, ANodeThatSomebodyStoppedIsStartedAgain) {
  Build({std::string(kCyclic) + ", heartbeat_ms: 300"});
  RunFor(2 * kSecond);
  Set("nmt", "pre_operational");
  RunFor(3 * kSecond);
  const std::size_t before = output().samples.size();
  RunFor(kSecond);
  EXPECT_GT(output().samples.size(), before + 50);
  Set("nmt", "stopped");
  RunFor(5 * kSecond);
  const std::size_t stopped = output().samples.size();
  RunFor(kSecond);
  EXPECT_GT(output().samples.size(), stopped + 50) << "first entered pre-operational, where it answers";
}

TEST_F(Cia406DeviceTest, SyncIsSentInTheLiveSlotsAndAnswered) {
  Build({kSyncMode, "node: 6, bits: 13, turn_bits: 12, transmission: sync"}, 100);
  RunFor(2 * kSecond);
  EXPECT_NEAR(static_cast<double>(nodes_->Count(0x080)), 200, 3) << "one producer for both";
  for (std::size_t device = 0; device < 2; ++device) {
    EXPECT_GT(output(device).samples.size(), 150U);
    EXPECT_TRUE(output(device).errors.empty());
  }
  const Sample& sample = output().samples.back();
  EXPECT_LE(sample.at.last - sample.at.first, 200 * kMicrosecond) << "from SYNC to the position's arrival";
}

TEST_F(Cia406DeviceTest, ASyncWithoutAPositionIsATimeout) {
  Build({kSyncMode}, 100);
  RunFor(2 * kSecond);
  Set("object", "1800:02=254");
  Set("object", "1800:05=0");
  RunFor(100 * kMillisecond);
  EXPECT_GT(Errors(ErrorKind::kTimeout), 2U);
  RunFor(5 * kSecond);
  ASSERT_FALSE(output().refused.empty()) << "identified again";
  EXPECT_THAT(output().refused.back(),
              HasSubstr("transmission type 254 (1800h sub 2), transmission: sync needs 1"));
}

TEST_F(Cia406DeviceTest, ASecondSyncProducerIsAnAlarm) {
  Build({kSyncMode}, 100);
  RunFor(kSecond);
  nodes_->intruder = {.id = 0x080, .data = {}};
  nodes_->intruder_at = clock_.Now() + 3 * kMillisecond;
  RunFor(100 * kMillisecond);
  EXPECT_EQ(AlarmOf(0x143), AlarmState::kLive);
}

TEST_F(Cia406DeviceTest, PolledBySdo) {
  Build({kPolledMode}, 100, "answer_us: 400, start_deg: 180");
  RunFor(2 * kSecond);
  EXPECT_GT(output().samples.size(), 150U);
  EXPECT_TRUE(output().errors.empty());
  EXPECT_EQ(LastPosition() & 0x1FFF, 4096);
  EXPECT_EQ(output().samples.back().at.last - output().samples.back().at.first, 400 * kMicrosecond);
  EXPECT_EQ(nodes_->Count(0x000), 0U) << "SDO needs no operational node";
}

// An answer that is later than its time-out must not pass for the next one's: every sample holds the instant at
// which the shaft was there.
TEST_F(Cia406DeviceTest, ALateAnswerIsFenced) {
  constexpr double kRpm = 300;
  Build({std::string(kPolledMode) + ", sdo_timeout_ms: 5"}, 100, "speed_rpm: 300");
  Shaft shaft;
  shaft.Run(kRpm, clock_.Now());
  for (int round = 0; round < 20; ++round) {
    RunFor(2 * kSecond);
    Set("fault", "delayed:12");
    RunFor((10 + round) * kMillisecond);
    Set("fault", "none");
  }
  EXPECT_GT(output().samples.size(), 500U);
  EXPECT_GT(Errors(ErrorKind::kTimeout), 10U);
  EXPECT_GT(node().counters().aborted, 10);
  for (const Sample& sample : output().samples) {
    const auto counts = [&](MonoNs at) { return -(shaft.At(at).angle) >> (kTurnBits - 13); };  // clockwise
    const std::int64_t is = std::int64_t{sample.turns} << 13 | sample.counts;
    const std::int64_t range = std::int64_t{1} << 25;
    const std::int64_t behind = ((counts(sample.at.first) - is) % range + range) % range;
    EXPECT_LE(behind, counts(sample.at.first) - counts(sample.at.last)) << is;
  }
}

TEST_F(Cia406DeviceTest, SilenceIsCountedOnceAndTheNodeIdentifiedAgain) {
  Build({kCyclic});
  RunFor(kSecond);
  Set("power", "off");
  RunFor(5 * kSecond);
  EXPECT_EQ(Errors(ErrorKind::kSilent), 1U);
  EXPECT_LT(nodes_->sent.size(), 100U);
  const std::size_t before = output().samples.size();
  Set("power", "on");
  RunFor(3 * kSecond);
  EXPECT_GT(output().samples.size(), before + 100);
  EXPECT_EQ(output().jumps, 0) << "the same encoder";
}

TEST_F(Cia406DeviceTest, ABootUpInTheMiddleIsIdentifiedAnew) {
  Build({kCyclic}, 0, "boot_ms: 5");
  RunFor(kSecond);
  const std::size_t requests = nodes_->Count(0x605);
  Set("power", "cycle");
  RunFor(kSecond);
  EXPECT_THAT(output().starting.back(), HasSubstr("boot-up"));
  EXPECT_GT(nodes_->Count(0x605), requests + 15);
  EXPECT_EQ(nodes_->Count(0x000), 2U) << "started again";
  EXPECT_EQ(Errors(ErrorKind::kSilent), 0U);
}

TEST_F(Cia406DeviceTest, AnExchangedEncoderIsAJump) {
  Build({kCyclic});
  RunFor(kSecond);
  Set("object", "1018:04=2002");
  Set("power", "cycle");
  RunFor(kSecond);
  EXPECT_EQ(output().jumps, 1);
  EXPECT_TRUE(output().refused.empty());
}

TEST_F(Cia406DeviceTest, TheConfiguredIdentityIsRequiredAndCheckedAgain) {
  Build({std::string(kCyclic) + ", identity: {serial: 77}"}, 0, "serial: 78");
  RunFor(kSecond);
  EXPECT_TRUE(output().samples.empty());
  EXPECT_EQ(AlarmOf(0x140), AlarmState::kLive);
  EXPECT_THAT(output().refused.at(0), HasSubstr("serial (1018h sub 4) is 0x4E, the file has 0x4D"));
  EXPECT_EQ(nodes_->Count(0x000), 0U) << "an unknown node is not made operational";
  Set("object", "1018:04=77");
  RunFor(5 * kSecond);
  EXPECT_FALSE(output().samples.empty());
  EXPECT_EQ(AlarmOf(0x140), AlarmState::kAbsent);
  EXPECT_EQ(output().refused.size(), 1U);
}

TEST_F(Cia406DeviceTest, ALostHeartbeatIsAnAlarm) {
  Build({std::string(kCyclic) + ", heartbeat_ms: 500"});
  RunFor(2 * kSecond);
  EXPECT_EQ(AlarmOf(0x141), AlarmState::kAbsent);
  Set("object", "1017:00=0");
  RunFor(kSecond);
  EXPECT_EQ(AlarmOf(0x141), AlarmState::kLive);
  Set("object", "1017:00=100");
  RunFor(kSecond);
  EXPECT_EQ(AlarmOf(0x141), AlarmState::kAbsent);
}

TEST_F(Cia406DeviceTest, AlarmsAndWarningsOfTheEncoder) {
  Build({std::string(kCyclic) + ", diagnostics_ms: 100"});
  RunFor(kSecond);
  Set("alarms", "0x1001");
  Set("warnings", "0x0010");
  RunFor(kSecond);
  EXPECT_EQ(AlarmOf(0x120), AlarmState::kLive) << "position_error";
  EXPECT_EQ(AlarmOf(0x12C), AlarmState::kLive);
  EXPECT_EQ(AlarmOf(0x134), AlarmState::kLive) << "battery_charge";
  EXPECT_TRUE(output().samples.back().error);
  EXPECT_TRUE(output().samples.back().warning);
  EXPECT_EQ(output().samples.back().device_status, 0x0010'1001);
  Set("alarms", "0x2000");
  Set("warnings", "0");
  RunFor(kSecond);
  EXPECT_EQ(AlarmOf(0x120), AlarmState::kAbsent);
  EXPECT_EQ(AlarmOf(0x12D), AlarmState::kAbsent) << "6504h does not name bit 13";
  EXPECT_FALSE(output().samples.back().error);
}

TEST_F(Cia406DeviceTest, AnEncoderWithoutDiagnosticsIsNotAskedAgain) {
  Build({std::string(kCyclic) + ", diagnostics_ms: 100"}, 0, "object: \"6503:00=none\"");
  Set("object", "6505:00=none");
  RunFor(kSecond);
  const std::int64_t requests = node().counters().requests;
  RunFor(5 * kSecond);
  EXPECT_LE(node().counters().requests - requests, 60);
  EXPECT_TRUE(output().errors.empty());
  EXPECT_FALSE(output().samples.empty());
}

TEST_F(Cia406DeviceTest, EmergenciesAreAlarmsByTheirCode) {
  Build({kCyclic});
  RunFor(kSecond);
  Set("emergency", "0x4210");
  RunFor(100 * kMillisecond);
  EXPECT_EQ(AlarmOf(0x14210), AlarmState::kLive);
  const Outcome& state = Do("read_state");
  EXPECT_THAT(state.text, HasSubstr("last EMCY 0x4210 (device temperature), register 0x09"));
  EXPECT_THAT(state.text, HasSubstr("errors: generic, temperature"));
  Set("emergency", "0");
  RunFor(100 * kMillisecond);
  EXPECT_EQ(AlarmOf(0x14210), AlarmState::kAbsent);
}

TEST_F(Cia406DeviceTest, ATpdoThatIsTooShortIsAnError) {
  Build({kCyclic});
  RunFor(kSecond);
  Set("fault", "short");
  RunFor(200 * kMillisecond);
  EXPECT_GT(Errors(ErrorKind::kShort), 5U);
}

TEST_F(Cia406DeviceTest, APositionAboveTheRangeIsAnError) {
  Build({"node: 5, bits: 13, turn_bits: 0, period_ms: 10"});
  RunFor(kSecond);
  nodes_->intruder = {.id = 0x185, .data = {0x00, 0x20, 0x00, 0x00}};
  nodes_->intruder_at = clock_.Now() + 3 * kMillisecond;
  RunFor(100 * kMillisecond);
  EXPECT_EQ(Errors(ErrorKind::kRange), 1U);
}

}  // namespace
}  // namespace axlecast::cia406
