// The driver against the strict simulator, and against events made by hand.
#include "drivers/biss/family.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "drivers/biss/bits_test_support.h"
#include "drivers/biss/machine_test_support.h"

namespace axlecast::biss {
namespace {

using ::testing::Each;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;

const std::string kSixteen = "bits: 16, unit: deg";
const std::string kThere = "start_deg: 195.3095";  // the manual's 35555 at 16 bits

DriverCommand ReadPosition(MonoNs begin_by = kNever) {
  DriverCommand order;
  order.id[0] = 1;
  order.operation = "read_position";
  order.begin_by = begin_by;
  return order;
}

TEST(BissDevice, ReadsTheManualsPosition) {
  Rig rig("", kSixteen, kThere);
  rig.ReadTimes(3);
  ASSERT_EQ(rig.output.samples.size(), 3U);
  EXPECT_EQ(rig.output.samples[0].counts, 35555);
  EXPECT_FALSE(rig.output.samples[0].has_turns);
  EXPECT_THAT(rig.output.errors, IsEmpty());
  EXPECT_EQ(rig.Complaints(), "");
  EXPECT_EQ(rig.Shown("frames"), "3");
}

TEST(BissDevice, ReadsTurns) {
  Rig rig("", "model: custom, max_speed_rpm: 6000, bits: 23, turn_bits: 16", "start_turns: 65535, start_deg: 90");
  rig.Read();
  ASSERT_EQ(rig.output.samples.size(), 1U);
  EXPECT_TRUE(rig.output.samples[0].has_turns);
  EXPECT_EQ(rig.output.samples[0].turns, 65535);
  EXPECT_EQ(rig.output.samples[0].counts, 1 << 21);
}

// Whole and fractional clocks of delay, in both modes. What falls onto a change of the line is left out: there the other
// mode is for.
TEST(BissDevice, ReadsAtAnyLineDelay) {
  for (const char* clock : {"1000000", "2500000", "8000000"}) {
    for (const bool rising : {false, true}) {
      Rig rig("line_delay_ns: 5000, sample_on: " + std::string(rising ? "rising" : "falling") +
                  ", link: {clock_hz: " + clock + "}",
              kSixteen, kThere);
      const MonoNs cycle = rig.settings().spi.ClockTime(1);
      std::size_t readings = 0;
      for (MonoNs delay = 0; delay <= 5'000; delay += 7) {
        const MonoNs phase = (delay + (rising ? 0 : cycle / 2)) % cycle;
        if (phase < 11 || phase > cycle - 11) continue;
        ASSERT_EQ(rig.Set("line_delay_ns", std::to_string(delay)), "");
        rig.Read();
        ++readings;
        ASSERT_EQ(rig.output.samples.size(), readings) << clock << ' ' << rising << ' ' << delay;
      }
      EXPECT_EQ(rig.Complaints(), "");
      EXPECT_GT(readings, 500U);
      for (const Sample& sample : rig.output.samples) EXPECT_EQ(sample.counts, 35555);
    }
  }
}

// At half a cycle the falling edges meet the changes: the check bits show it, and the other mode reads well.
TEST(BissDevice, ADelayOfHalfACycleIsForTheOtherMode) {
  Rig falling("link: {clock_hz: 1000000}", kSixteen, "line_delay_ns: 500, " + kThere);
  falling.ReadTimes(200);
  EXPECT_LT(falling.output.samples.size(), 20U);
  EXPECT_NE(falling.Shown("near_edges"), "0");
  Rig rising("link: {clock_hz: 1000000}, sample_on: rising", kSixteen, "line_delay_ns: 500, " + kThere);
  rising.ReadTimes(200);
  EXPECT_EQ(rising.output.samples.size(), 200U);
}

// 5.6: "Tbusy: Minimum data output delay = 2 x TMAS".
TEST(BissDevice, WaitsForABusyEncoder) {
  Rig rig("", kSixteen + ", busy_us: 30, busy_jitter_us: 40", kThere);
  for (const char* busy : {"0", "2", "10", "29.9"}) {
    ASSERT_EQ(rig.Set("busy_us", busy), "");
    for (const char* clocks : {"1", "2", "5"}) {
      ASSERT_EQ(rig.Set("busy_clocks", clocks), "");
      rig.Read();
    }
  }
  EXPECT_EQ(rig.output.samples.size(), 12U);
  EXPECT_EQ(rig.Complaints(), "");
  ASSERT_EQ(rig.Set("busy_us", "34"), "");
  rig.Read();
  EXPECT_THAT(rig.Errors(), ElementsAre("busy"));
}

// One inverted sample can hide the start bit; the first 1 of the position is then taken for it, and of the frames that
// are read shifted one in 64 passes the check.
TEST(BissDevice, AStartBitElsewhereIsBelievedWhenItStaysThere) {
  Rig rig("", kSixteen, kThere);
  rig.ReadTimes(2);
  ASSERT_EQ(rig.Set("busy_clocks", "5"), "");
  rig.Read();
  EXPECT_THAT(rig.Errors(), ElementsAre("framing"));
  EXPECT_EQ(rig.output.samples.size(), 2U);
  rig.ReadTimes(2);
  EXPECT_EQ(rig.output.samples.size(), 4U);
  ASSERT_EQ(rig.Set("busy_clocks", "6"), "");
  rig.Read();
  EXPECT_EQ(rig.output.samples.size(), 5U) << "a clock more or less is the line's";
}

TEST(BissDevice, NoOneWrongSampleGivesAnotherPosition) {
  for (int angle = 0; angle < 360; ++angle) {
    Rig rig("line_delay_ns: 3000", kSixteen + ", busy_us: 40",
            "busy_us: 9, start_deg: " + std::to_string(angle) + ".07");
    rig.Read();
    const std::int64_t counts = rig.output.samples.at(0).counts;
    const std::vector<std::uint8_t> good = rig.last_rx;
    for (std::size_t i = 0; i < 8 * good.size(); ++i) {
      std::vector<std::uint8_t> bad = good;
      bad[i / 8] = static_cast<std::uint8_t>(bad[i / 8] ^ 0x80U >> i % 8);
      rig.Tell(Event::Kind::kReply, bad);
      rig.Tell(Event::Kind::kReply, good);
    }
    for (const Sample& sample : rig.output.samples) EXPECT_EQ(sample.counts, counts) << angle;
  }
}

TEST(BissDevice, NamesWhatIsWrong) {
  struct Case {
    const char* key;
    const char* value;
    const char* error;
  };
  for (const Case& c :
       {Case{"power", "off", "timeout"}, Case{"fault", "off", "timeout"}, Case{"wiring", "open", "timeout"},
        Case{"wiring", "shorted", "framing"}, Case{"wiring", "swapped", "framing"}, Case{"cds", "on", "range"},
        Case{"fault", "slow:20", "busy"}, Case{"line_delay_ns", "2600", "timeout"}}) {
    Rig rig("", kSixteen, kThere);
    ASSERT_EQ(rig.Set(c.key, c.value), "");
    rig.ReadTimes(2);
    EXPECT_THAT(rig.output.samples, IsEmpty()) << c.key << ' ' << c.value;
    EXPECT_THAT(rig.Errors(), ElementsAre(c.error, c.error)) << c.key << ' ' << c.value;
    ASSERT_EQ(rig.Set("wiring", "good") + rig.Set("power", "on") + rig.Set("fault", "none") +
                  rig.Set("cds", "off") + rig.Set("line_delay_ns", "60"),
              "");
    rig.Read();
    EXPECT_EQ(rig.output.samples.size(), 1U) << "it resumes by itself after " << c.key;
  }
}

TEST(BissDevice, ADamagedFrameIsNone) {
  Rig rig("", kSixteen, kThere);
  ASSERT_EQ(rig.Set("fault", "bit_flip:0.01"), "");
  rig.ReadTimes(2'000);
  EXPECT_GT(rig.output.errors.size(), 200U);
  EXPECT_GT(rig.output.samples.size(), 1'000U);
  std::size_t wrong = 0;
  for (const Sample& sample : rig.output.samples) wrong += sample.counts == 35555 ? 0U : 1U;
  EXPECT_LT(wrong, 20U);
}

// 5.6: "The first rising edge of MA+ latches the sensor status".
TEST(BissDevice, TheInstantHoldsTheFirstRisingEdge) {
  Rig rig("link: {clock_hz: 1000000}", kSixteen, "speed_rpm: 3000");
  for (const MonoNs setup : {MonoNs{0}, MonoNs{700}, MonoNs{20'000}}) {
    rig.Read(setup);
    const Interval at = rig.output.samples.back().at;
    const MonoNs latch = rig.latest_edge + 500;
    EXPECT_LE(at.first, latch);
    EXPECT_GE(at.last, latch);
    EXPECT_LE(at.last - at.first, 2 * setup + 1'000) << "no wider than the host's time and a cycle";
  }
}

TEST(BissDevice, AStretchThatTurnsRoundIsNone) {
  Rig rig("", kSixteen, kThere);
  const Step step = rig.Next();
  rig.Read();
  const Interval faster{rig.now,
                        rig.now + 1};  // than its clocks: a clock that differs from the controller's setting
  rig.device().On({.kind = Event::Kind::kReply,
                   .sent = faster,
                   .received = faster,
                   .request = std::get<Exchange>(step.action).request,
                   .bytes = rig.last_rx});
  EXPECT_LE(rig.output.samples.back().at.first, rig.output.samples.back().at.last);
}

TEST(BissDevice, LooksLessOftenForAnEncoderThatIsNotThere) {
  Rig rig("", kSixteen, "power: off");
  rig.ReadTimes(4);
  const Step next = rig.Next();
  ASSERT_TRUE(std::holds_alternative<Idle>(next.action));
  const MonoNs until = std::get<Idle>(next.action).until;
  EXPECT_NEAR(static_cast<double>(until - rig.now), 1e8, 1e6);
  rig.device().Begin(ReadPosition(), rig.now);
  EXPECT_TRUE(std::holds_alternative<Exchange>(rig.Next().action)) << "an order does not wait";
  rig.now = until;
  ASSERT_EQ(rig.Set("power", "on"), "");
  rig.ReadTimes(2);
  EXPECT_EQ(rig.output.samples.size(), 2U);
}

// nError and nWarning are active low; an alarm counts when two frames in a row agree on it, the sample's flag at once.
TEST(BissDevice, ErrorAndWarningAreAlarms) {
  constexpr int kErrorAlarm = 0x100;
  constexpr int kWarningAlarm = 0x101;
  Rig rig("", kSixteen, kThere);
  rig.ReadTimes(2);
  EXPECT_THAT(rig.output.alarms, ElementsAre(std::pair(kErrorAlarm, AlarmState::kAbsent),
                                             std::pair(kWarningAlarm, AlarmState::kAbsent)));
  rig.output.alarms.clear();
  ASSERT_EQ(rig.Set("error", "on"), "");
  rig.Read();
  EXPECT_TRUE(rig.output.samples.back().error);
  EXPECT_EQ(rig.output.samples.back().device_status, 0b01);
  EXPECT_THAT(rig.output.alarms, IsEmpty());
  rig.ReadTimes(3);
  EXPECT_THAT(rig.output.alarms, ElementsAre(std::pair(kErrorAlarm, AlarmState::kLive)));
  rig.output.alarms.clear();
  ASSERT_EQ(rig.Set("error", "off") + rig.Set("warning", "on"), "");
  rig.ReadTimes(3);
  EXPECT_FALSE(rig.output.samples.back().error);
  EXPECT_TRUE(rig.output.samples.back().warning);
  EXPECT_EQ(rig.output.samples.back().device_status, 0b10);
  EXPECT_THAT(rig.output.alarms, ElementsAre(std::pair(kErrorAlarm, AlarmState::kAbsent),
                                             std::pair(kWarningAlarm, AlarmState::kLive)));
}

// 5.6: "Timeout: 16 us"; "Idle state: clock and data lines stay high".
TEST(BissDevice, ThePauseIsLongerThanTheTimeOut) {
  Rig rig("", kSixteen, kThere);
  EXPECT_EQ(rig.bus().pacing.after_reply, 20'500) << "16 us, a quarter more, and the line's delay";
  for (int i = 0; i < 100; ++i) rig.Read(0);
  EXPECT_EQ(rig.Complaints(), "");
  rig.now -= rig.bus().pacing.after_reply;  // as if the runtime kept none
  rig.Read(0);
  EXPECT_EQ(rig.Complaints(), "early 1");
  EXPECT_THAT(rig.Errors(), ElementsAre("framing")) << "the line is low still";
}

TEST(BissDevice, AnEncoderWithALongerTimeOutNeedsTheKey) {
  Rig rig("", kSixteen, "timeout_us: 40, " + kThere);
  for (int i = 0; i < 10; ++i) rig.Read(0);
  EXPECT_EQ(rig.output.samples.size(), 1U);
  Rig told("timeout_us: 40", kSixteen, "timeout_us: 40, " + kThere);
  for (int i = 0; i < 10; ++i) told.Read(0);
  EXPECT_EQ(told.output.samples.size(), 10U);
}

TEST(BissDevice, EventsMadeByHand) {
  Rig rig("", kSixteen, kThere);
  rig.Tell(Event::Kind::kTimeout, {});
  rig.Tell(Event::Kind::kTimeout, BytesOf("1100 10 10"));
  rig.Tell(Event::Kind::kUnexpectedBytes, BytesOf("11111111"));
  EXPECT_THAT(rig.Errors(), ElementsAre("timeout", "short", "stray"));
  rig.Tell(Event::Kind::kLinkDown, {});
  EXPECT_TRUE(std::holds_alternative<Idle>(rig.Next().action));
  rig.Tell(Event::Kind::kLinkUp, {});
  EXPECT_TRUE(std::holds_alternative<Exchange>(rig.Next().action));
  EXPECT_TRUE(std::holds_alternative<Idle>(rig.Next(false).action)) << "nothing is due";
}

// ---- operations ----

TEST(BissOperations, ReadPositionShowsOneReading) {
  Rig rig("", kSixteen, kThere);
  rig.device().Begin(ReadPosition(), rig.now);
  EXPECT_EQ(rig.Next(false).priority, Priority::kCommand);
  rig.Read(0, false);
  ASSERT_EQ(rig.output.outcomes.size(), 1U);
  const Outcome& outcome = rig.output.outcomes[0].second;
  EXPECT_EQ(outcome.state, CommandState::kSucceeded);
  EXPECT_TRUE(outcome.verified);
  EXPECT_THAT(outcome.text, HasSubstr("35555 (195.3094 deg)"));
  ASSERT_EQ(outcome.changes.size(), 3U);
  EXPECT_EQ(outcome.changes[0].after, "35555");
  EXPECT_EQ(outcome.changes[1].after, "2") << "acknowledged at sample 2";
  EXPECT_EQ(outcome.changes[2].after, "4");
  EXPECT_TRUE(std::holds_alternative<Idle>(rig.Next(false).action));
}

TEST(BissOperations, APositionThatIsNotValidIsNoSuccess) {
  Rig rig("", "bits: 16, turn_bits: 4", "error: on, warning: on, start_turns: 9");
  rig.device().Begin(ReadPosition(), rig.now);
  rig.Read();
  EXPECT_EQ(rig.output.outcomes.at(0).second.state, CommandState::kFailed);
  EXPECT_THAT(rig.output.outcomes[0].second.text, HasSubstr("turns 9"));
}

TEST(BissOperations, GivesUpAfterFiveTransfers) {
  Rig rig("", kSixteen, "power: off");
  rig.device().Begin(ReadPosition(), rig.now);
  rig.ReadTimes(4);
  EXPECT_THAT(rig.output.outcomes, IsEmpty());
  rig.Read();
  ASSERT_EQ(rig.output.outcomes.size(), 1U);
  EXPECT_EQ(rig.output.outcomes[0].second.state, CommandState::kFailed);
  EXPECT_THAT(rig.output.outcomes[0].second.text, HasSubstr("timeout"));
}

TEST(BissOperations, Refusals) {
  Rig rig("", kSixteen, kThere);
  DriverCommand unknown = ReadPosition();
  unknown.operation = "zero";
  rig.device().Begin(unknown, rig.now);
  rig.device().Begin(ReadPosition(rig.now - 1), rig.now);
  rig.device().Begin(ReadPosition(), rig.now);
  rig.device().Begin(ReadPosition(), rig.now);
  EXPECT_TRUE(rig.device().Cancel(ReadPosition().id, rig.now));
  EXPECT_FALSE(rig.device().Cancel(ReadPosition().id, rig.now));
  rig.device().Begin(ReadPosition(rig.now + 1), rig.now);
  rig.now += 2;
  rig.Read();
  rig.device().Begin(ReadPosition(), rig.now);
  rig.Tell(Event::Kind::kLinkDown, {});
  rig.device().Begin(ReadPosition(), rig.now);
  std::vector<CommandState> states;
  for (const auto& [id, outcome] : rig.output.outcomes) states.push_back(outcome.state);
  EXPECT_THAT(states, ElementsAre(CommandState::kRejected, CommandState::kExpired, CommandState::kRejected,
                                  CommandState::kExpired, CommandState::kFailed, CommandState::kRejected));
}

}  // namespace
}  // namespace axlecast::biss
