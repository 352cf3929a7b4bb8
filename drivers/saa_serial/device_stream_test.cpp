// Mode timing: the device on a simulated line, in virtual time.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>

#include "core/device/operation.h"
#include "drivers/saa_serial/simulated_line_test_support.h"

namespace axlecast::saa_serial {
namespace {

using ::testing::IsEmpty;

// A real line (simulate: false): times on the wire count.
const std::string kReal = "link: {port: /dev/ttyX, baud: 115200}, mode: timing, refresh_hz: 1000";

TEST(SaaStream, ReadsEveryFrame) {
  SimulatedBus bus(kReal, "a: {bits: 14}", "a: {start_deg: 90}");
  bus.Run(kSecond);
  EXPECT_NEAR(static_cast<double>(bus.output().samples.size()), 1'000, 2);
  EXPECT_THAT(bus.output().errors, IsEmpty());
  EXPECT_EQ(bus.output().samples.back().counts, 4'096);
  EXPECT_FALSE(bus.output().samples.back().has_turns);
  EXPECT_THAT(bus.line->written, IsEmpty()) << "it never transmits";
}

// The shaft turns, so the counts show their sampling time, which must lie within the interval.
class SaaStreamInstant : public ::testing::TestWithParam<std::tuple<int, int, int>> {};

TEST_P(SaaStreamInstant, LiesWithinTheInterval) {
  const auto [refresh_hz, hold_us, stall_us] = GetParam();
  SimulatedBus bus("link: {port: /dev/ttyX, baud: 921600}, mode: timing, refresh_hz: " + std::to_string(refresh_hz),
                   "a: {bits: 26, latency_us: " + std::to_string(hold_us) + "}",
                   "a: {accel_rad_s2: 200000, speed_rpm: 60, processing_us: 150}", hold_us * kMicrosecond);
  constexpr double kRpm = 60;
  bus.Run(100 * kMillisecond);
  bus.output().samples.clear();
  const MonoNs from = bus.clock.Now();
  // Angle at any instant, from the simulator itself.
  const auto angle_at = [&](MonoNs at) {
    for (const auto& [key, value] : bus.wire().State("a", at)) {
      if (key == "angle_deg") return std::stod(value);
    }
    return 0.0;
  };
  const double angle = angle_at(from);
  for (int i = 0; i < 50; ++i) {
    bus.Run(21 * kMillisecond);
    bus.line->Stall(stall_us * kMicrosecond);
  }
  ASSERT_GT(bus.output().samples.size(), 20U);
  for (const Sample& sample : bus.output().samples) {
    // The nearest time at which the shaft was at the sampled position.
    const double degrees = Degrees(sample.counts, 26);
    const double expected = angle + static_cast<double>(sample.at.Middle() - from) * 1e-9 * kRpm * 6;
    const double off = std::remainder(degrees - expected, 360.0);
    const auto sampled = sample.at.Middle() + static_cast<MonoNs>(off / (kRpm * 6) * 1e9);
    EXPECT_GE(sampled, sample.at.first - kMicrosecond);
    EXPECT_LE(sampled, sample.at.last + kMicrosecond);
  }
  if (stall_us == 0 && hold_us == 0) {
    const MonoNs period = kSecond / refresh_hz;
    const Interval& at = bus.output().samples.back().at;
    EXPECT_LE(at.last - at.first, 2 * period + kMillisecond) << "no wider than what is not known";
  }
}

INSTANTIATE_TEST_SUITE_P(Each, SaaStreamInstant,
                         ::testing::Combine(::testing::Values(50, 1'000, 5'000),
                                            ::testing::Values(0, 1'000, 16'000),
                                            ::testing::Values(0, 3'000, 30'000)));

// An adapter that stalls hands several frames over late and at once, some of them in pieces: each must still be as old as
// its interval allows.
class SaaStreamLate : public ::testing::TestWithParam<std::tuple<int, const char*>> {};

TEST_P(SaaStreamLate, FramesThatComeLateLieWithinTheirIntervals) {
  const auto [refresh_hz, fault] = GetParam();
  constexpr double kRpm = 30;
  SimulatedBus bus("link: {port: /dev/ttyX, baud: 921600}, mode: timing, refresh_hz: " + std::to_string(refresh_hz),
                   "a: {bits: 26, latency_us: 1000, processing_us: 20}",
                   "a: {accel_rad_s2: 200000, speed_rpm: " + std::to_string(kRpm) + "}");
  bus.Run(300 * kMillisecond);
  const MonoNs from = bus.clock.Now();
  double angle = 0;
  for (const auto& [key, value] : bus.wire().State("a", from)) {
    if (key == "angle_deg") angle = std::stod(value);
  }
  // Returns the distance of the interval from the time at which the shaft was at the sampled position.
  const auto beyond = [&](const Sample& sample) {
    const double expected = angle + static_cast<double>(sample.at.Middle() - from) * 1e-9 * kRpm * 6;
    const double off = std::remainder(Degrees(sample.counts, 26) - expected, 360.0);
    const auto sampled = sample.at.Middle() + static_cast<MonoNs>(off / (kRpm * 6) * 1e9);
    return std::max(sample.at.first - sampled, sampled - sample.at.last);
  };
  bus.output().samples.clear();
  MonoNs widest = 0;
  for (int i = 0; i < 40; ++i) {
    bus.Set("a", "fault", i % 2 == 0 ? fault : "none");
    bus.Run((37 + 11 * (i % 7)) * kMillisecond);
    for (const Sample& sample : bus.output().samples) {
      ASSERT_LE(beyond(sample), kMicrosecond) << i;
      widest = std::max(widest, sample.at.last - sample.at.first);
    }
    bus.output().samples.clear();
  }
  EXPECT_LE(widest, 510 * kMillisecond + 2 * kSecond / refresh_hz) << "never wider than late_us and a frame";
  // The last late frame comes 0.4 s after the fault, and late_us (0.5 s) after its pause no frame can be late any more: the
  // intervals are as narrow as before.
  bus.Set("a", "fault", "none");
  bus.Run(kSecond);
  bus.output().samples.clear();
  bus.Run(100 * kMillisecond);
  ASSERT_FALSE(bus.output().samples.empty());
  for (const Sample& sample : bus.output().samples) {
    ASSERT_LE(beyond(sample), kMicrosecond);
    ASSERT_LE(sample.at.last - sample.at.first, kSecond / refresh_hz + 2 * kMillisecond);
  }
}

INSTANTIATE_TEST_SUITE_P(Each, SaaStreamLate,
                         ::testing::Combine(::testing::Values(50, 1'000, 5'000),
                                            ::testing::Values("late:25", "late:80", "delayed:30", "late:400")));

// A host that sleeps for some periods again and again, as a busy one does, finds every frame when it wakes: none is late, and
// intervals must not grow.
TEST(SaaStream, AHostThatSleepsNowAndThenWidensIntervalsByOnePeriodAtMost) {
  SimulatedBus bus(kReal, "a: {bits: 14}", "a: {start_deg: 90}");
  bus.Run(100 * kMillisecond);
  for (int i = 0; i < 200; ++i) {
    bus.line->Stall((5 + i % 7) * kMillisecond + i % 5 * 200 * kMicrosecond);
    bus.Run(20 * kMillisecond);
    bus.output().samples.clear();
    bus.Run(20 * kMillisecond);
    ASSERT_GT(bus.output().samples.size(), 15U);
    // A period, T3 of a period, latency_us, and a period that may still be missing.
    for (const Sample& sample : bus.output().samples)
      ASSERT_LE(sample.at.last - sample.at.first, 5'500 * kMicrosecond) << i;
  }
}

TEST(SaaStream, SilenceIsReportedOnceAndItsEndIsFound) {
  SimulatedBus bus(kReal, "a: {bits: 14, latency_us: 0}");
  bus.Run(100 * kMillisecond);
  bus.Set("a", "power", "off");
  const MonoNs off = bus.clock.Now();
  bus.Run(kSecond);
  ASSERT_EQ(bus.output().errors.size(), 1U);
  EXPECT_EQ(bus.output().errors[0].first, ErrorKind::kSilent);
  EXPECT_LE(bus.output().errors[0].second.last - off, 5 * kMillisecond);
  bus.output().samples.clear();
  bus.Set("a", "power", "on");
  bus.Run(100 * kMillisecond);
  EXPECT_GT(bus.output().samples.size(), 95U);
}

TEST(SaaStream, NoiseIsCountedAndCostsLittleMore) {
  SimulatedBus bus(kReal, "a: {bits: 14}", "a: {start_deg: 90, fault: 'bit_flip:0.001'}");
  bus.Run(10 * kSecond);
  const double good = std::pow(0.999, 40);  // frames without a flipped bit
  EXPECT_NEAR(static_cast<double>(bus.output().samples.size()), 10'000 * good, 60);
  const auto errors = bus.Errors("a");
  EXPECT_NEAR(
      errors.at(ErrorKind::kChecksum) + (errors.contains(ErrorKind::kRange) ? errors.at(ErrorKind::kRange) : 0),
      10'000 * (1 - good), 60);
}

TEST(SaaStream, ShortFramesDoNotTakeTheNextWithThem) {
  SimulatedBus bus(kReal, "a: {bits: 16}", "a: {start_deg: 90, fault: 'short:0.3'}");
  bus.Run(10 * kSecond);
  EXPECT_NEAR(static_cast<double>(bus.output().samples.size()), 7'000, 300);
  for (const Sample& sample : bus.output().samples) EXPECT_EQ(sample.counts, 16'384);
}

const std::string kWithClr = kReal + ", lines: {clr: {chip: /dev/gpiochip0, line: 6}}";

TEST(SaaStream, ZeroIsOnePulseOnClrVerifiedByReading) {
  SimulatedBus bus(kWithClr, "a: {bits: 14}", "a: {start_deg: 90}");
  bus.Run(100 * kMillisecond);
  bus.Begin(0, "zero");
  bus.Run(kSecond);
  ASSERT_EQ(bus.line->pulses.size(), 1U);
  EXPECT_EQ(bus.line->pulses[0].first, 0);
  EXPECT_EQ(bus.Count("a", "zeroings"), 1);
  ASSERT_EQ(bus.FinalTexts("a").size(), 1U);
  const Outcome& outcome = bus.output().outcomes.back().second;
  EXPECT_EQ(outcome.state, CommandState::kSucceeded);
  EXPECT_TRUE(outcome.verified);
  EXPECT_EQ(outcome.changes.at(0).before, "4096");
  EXPECT_EQ(outcome.changes.at(0).after, "0");
  const Outcome& running = bus.output().outcomes.front().second;
  EXPECT_EQ(running.state, CommandState::kRunning);
  EXPECT_EQ(running.changes.at(0).before, "4096") << "should the driver die now";
  EXPECT_EQ(bus.output().jumps, 1);
  EXPECT_EQ(bus.output().nv_writes, 1);
  EXPECT_FALSE(bus.output().datum_changing);
  EXPECT_EQ(bus.output().samples.back().counts, 0);
}

TEST(SaaStream, ZeroThatDoesNothingFails) {
  SimulatedBus bus(kWithClr, "a: {bits: 14}", "a: {start_deg: 90, zero_error_deg: 5}");
  bus.Run(100 * kMillisecond);
  bus.Begin(0, "zero");
  bus.Run(kSecond);
  const Outcome& outcome = bus.output().outcomes.back().second;
  EXPECT_EQ(outcome.state, CommandState::kFailed);
  EXPECT_EQ(bus.line->pulses.size(), 1U) << "never repeated";
  EXPECT_EQ(bus.output().jumps, 1) << "the position may have jumped";
}

TEST(SaaStream, ZeroWithoutAClrLineIsRefused) {
  SimulatedBus bus(kReal, "a: {bits: 14}");
  bus.Run(100 * kMillisecond);
  bus.Begin(0, "zero");
  EXPECT_EQ(bus.output().outcomes.at(0).second.state, CommandState::kRejected);
  EXPECT_THAT(bus.output().outcomes.at(0).second.text, ::testing::HasSubstr("no CLR line"));
}

TEST(SaaStream, ZeroOfAShaftThatBeginsToTurnDoesNothing) {
  SimulatedBus bus(kWithClr, "a: {bits: 14}");
  bus.Run(100 * kMillisecond);
  bus.Begin(0, "zero");
  bus.output().motion.standstill = false;
  bus.output().motion.speed_rpm = 12;
  bus.Run(kSecond);
  EXPECT_THAT(bus.line->pulses, IsEmpty());
  ASSERT_EQ(bus.FinalTexts("a").size(), 1U);
  EXPECT_THAT(bus.FinalTexts("a")[0], ::testing::HasSubstr("the shaft turns at 12 rpm"));
}

TEST(SaaStream, ASilentEncoderAfterZeroLeavesItOpen) {
  SimulatedBus bus(kWithClr, "a: {bits: 14}");
  bus.Run(100 * kMillisecond);
  bus.Begin(0, "zero");
  while (bus.line->pulses.empty()) bus.Run(kMillisecond);
  bus.Set("a", "power", "off");
  bus.Run(5 * kSecond);
  EXPECT_EQ(bus.output().outcomes.back().second.state, CommandState::kIndeterminate);
  EXPECT_TRUE(bus.output().datum_changing);
  bus.Set("a", "power", "on");
  bus.Run(kSecond);
  EXPECT_FALSE(bus.output().datum_changing);
  EXPECT_EQ(bus.output().jumps, 1);
}

TEST(SaaStream, ALinkThatIsLostWithThePulseLeavesItOpen) {
  SimulatedBus bus(kWithClr, "a: {bits: 14}", "a: {start_deg: 90}");
  bus.Run(100 * kMillisecond);
  bus.Begin(0, "zero");
  bus.line->LoseAfterNextRequest();
  bus.Run(kSecond);
  EXPECT_EQ(bus.output().outcomes.back().second.state, CommandState::kIndeterminate);
  EXPECT_EQ(bus.output().jumps, 1);
  bus.Begin(0, "read_position", {{"after", "zero"}});
  bus.Run(kSecond);
  const Outcome& finding = bus.output().outcomes.back().second;
  EXPECT_EQ(finding.state, CommandState::kSucceeded);
  EXPECT_EQ(finding.changes.at(1).after, "reads_as_after");
}

}  // namespace
}  // namespace axlecast::saa_serial
