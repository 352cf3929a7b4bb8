// Modes handshake and bus: devices on a simulated line, in virtual time.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "core/device/operation.h"
#include "drivers/saa_serial/simulated_line_test_support.h"

namespace axlecast::saa_serial {
namespace {

using ::testing::Contains;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::Key;

// Real lines (simulate: false): times on the wire count.
const std::string kLink = "link: {port: /dev/ttyX, baud: 115200}, poll_hz: 100";
const std::string kHandshake = kLink + ", mode: handshake, lines: {clk: {chip: /dev/gpiochip0, line: 5}";
const std::string kBus = kLink + ", mode: bus";
const std::string kThree =
    "a: {bits: 14, address: 1, reply_header: address}, b: {bits: 20, address: 2}, c: {bits: 26, address: 3}";
const std::string kThreeSimulated =
    "a: {start_deg: 90, reply_header: address}, b: {start_deg: 180}, c: {start_deg: 270}";

std::vector<std::uint8_t> Written(const SimulatedBus& bus, std::size_t index) {
  return bus.line->written.at(index).second;
}

TEST(SaaHandshake, EachFallingEdgeGivesAReading) {
  SimulatedBus bus(kHandshake + "}", "a: {bits: 17}", "a: {start_deg: 90}");
  bus.Run(kSecond);
  EXPECT_NEAR(static_cast<double>(bus.output().samples.size()), 100, 2);
  EXPECT_THAT(bus.output().errors, IsEmpty());
  EXPECT_EQ(bus.output().samples.back().counts, 32'768);
  EXPECT_THAT(bus.line->written, IsEmpty()) << "it never transmits";
  EXPECT_EQ(bus.Count("a", "short_pulses"), 0);
  EXPECT_EQ(bus.line->pulses.size(), static_cast<std::size_t>(bus.Count("a", "requests")));
}

TEST(SaaHandshake, TheInstantLiesBetweenTheEdgeAndTheFirstBit) {
  SimulatedBus bus(kHandshake + "}", "a: {bits: 26}",
                   "a: {accel_rad_s2: 200000, speed_rpm: 60, processing_us: 300}");
  bus.Run(kSecond);
  const Sample& sample = bus.output().samples.back();
  EXPECT_EQ(sample.at.first, bus.line->pulses.back().second);
  // Its seven characters were not yet on the line, nor was T3 over.
  EXPECT_NEAR(static_cast<double>(sample.at.last - sample.at.first), 300e3, 100e3);
}

TEST(SaaHandshake, ZeroIsOnePulseOnClrBetweenReadings) {
  SimulatedBus bus(kHandshake + ", clr: {chip: /dev/gpiochip0, line: 6, low_us: 700}}", "a: {bits: 14}",
                   "a: {start_deg: 90}");
  bus.Run(100 * kMillisecond);
  bus.Begin(0, "zero");
  bus.Run(2 * kSecond);
  EXPECT_EQ(std::count_if(bus.line->pulses.begin(), bus.line->pulses.end(), [](auto& p) { return p.first == 1; }),
            1);
  EXPECT_EQ(bus.Count("a", "zeroings"), 1);
  const Outcome& outcome = bus.output().outcomes.back().second;
  EXPECT_EQ(outcome.state, CommandState::kSucceeded) << outcome.text;
  EXPECT_TRUE(outcome.verified);
  EXPECT_EQ(bus.output().samples.back().counts, 0);
  EXPECT_EQ(bus.output().jumps, 1);
}

// So that the instant of the reply is that of its own first byte, and its wait does not begin with stray ones.
TEST(SaaBusMode, TellsTheBusWhereItsReplyBegins) {
  SimulatedBus bus(kBus, kThree, kThreeSimulated);
  bus.Run(100 * kMillisecond);
  const Step step = bus.device().Next({.now = bus.clock.Now(), .poll_due = true});
  ASSERT_TRUE(std::holds_alternative<Exchange>(step.action));
  const auto& exchange = std::get<Exchange>(step.action);
  ASSERT_NE(exchange.reply_begin, nullptr);
  const std::vector<std::uint8_t> with_stray = {0x00, 0x33, 0xFF, 0x01, 0x12, 0x34, 0x00};
  EXPECT_EQ(exchange.reply_begin(with_stray), 2U);
}

// 5.1.5 (1): three encoders of one batch.
TEST(SaaBusMode, EachEncoderIsAskedByItsOwnCommand) {
  SimulatedBus bus(kBus, kThree, kThreeSimulated);
  bus.Run(kSecond);
  EXPECT_EQ(bus.outputs["a"].samples.back().counts, 4'096);
  EXPECT_EQ(bus.outputs["b"].samples.back().counts, 1 << 19);
  EXPECT_EQ(bus.outputs["c"].samples.back().counts, 3 << 24);
  for (const char* name : {"a", "b", "c"}) {
    EXPECT_NEAR(static_cast<double>(bus.outputs[name].samples.size()), 100, 2) << name;
    EXPECT_THAT(bus.outputs[name].errors, IsEmpty()) << name;
  }
  EXPECT_THAT(Written(bus, 0), ElementsAre(0xBC, 0xAA, 0xB1));
  EXPECT_THAT(Written(bus, 1), ElementsAre(0xBC, 0xAA, 0xB2));
  EXPECT_THAT(Written(bus, 2), ElementsAre(0xBC, 0xAA, 0xB3));
}

TEST(SaaBusMode, TheReplysHeaderIsCheckedAsConfigured) {
  SimulatedBus bus(kBus,
                   "a: {bits: 14, address: 1, reply_header: address}, b: {bits: 14, address: 2, reply_header: 81},"
                   "c: {bits: 14, address: 3}",
                   "b: {reply_header: address}, c: {reply_header: address}");
  bus.Run(100 * kMillisecond);
  EXPECT_THAT(bus.outputs["a"].samples, IsEmpty()) << "81 where the address is required";
  EXPECT_THAT(bus.Errors("a"), Contains(Key(ErrorKind::kWrongEcho)));
  EXPECT_THAT(bus.outputs["b"].samples, IsEmpty()) << "the address where 81 is required";
  EXPECT_FALSE(bus.outputs["c"].samples.empty()) << "either";
}

// An adapter hands a reply over when the next unit was asked already, unless the driver waits. All three have the same
// resolution and the fixed header, so that the bytes do not distinguish them: no request is sent before the late reply
// has come, or can come no more.
TEST(SaaBusMode, ALateReplyNeverBecomesAnotherUnitsValue) {
  const std::string fixed = ", bits: 14, reply_header: 81, timeout_us: 5000, silence_us: 2000}";
  for (int held_ms = 1; held_ms < 10; ++held_ms) {
    SimulatedBus bus(kBus, "a: {address: 1" + fixed + ", b: {address: 2" + fixed + ", c: {address: 3" + fixed,
                     "a: {start_deg: 90, fault: 'delayed:" + std::to_string(held_ms) +
                         "'}, b: {start_deg: 180}, c: {start_deg: 270}",
                     0, 500 * kMillisecond);
    bus.Run(2 * kSecond);
    for (const Sample& sample : bus.outputs["b"].samples) ASSERT_EQ(sample.counts, 8'192) << held_ms;
    for (const Sample& sample : bus.outputs["c"].samples) ASSERT_EQ(sample.counts, 12'288) << held_ms;
    for (const Sample& sample : bus.outputs["a"].samples) ASSERT_EQ(sample.counts, 4'096) << held_ms;
    EXPECT_GT(bus.outputs["b"].samples.size(), 20U) << held_ms;
  }
}

TEST(SaaBusMode, ALateReplyWithAnAddressIsRefusedHoweverLate) {
  const std::string address = ", bits: 14, reply_header: address, timeout_us: 2000, silence_us: 50}";
  for (int held_ms = 1; held_ms < 40; ++held_ms) {
    SimulatedBus bus(kBus, "a: {address: 1" + address + ", b: {address: 2" + address,
                     "a: {start_deg: 90, reply_header: address, fault: 'delayed:" + std::to_string(held_ms) +
                         "'}, b: {start_deg: 180, reply_header: address}");
    bus.Run(2 * kSecond);
    for (const Sample& sample : bus.outputs["b"].samples) ASSERT_EQ(sample.counts, 8'192) << held_ms;
  }
}

TEST(SaaBusMode, AnEchoingAdapterNeedsItsKey) {
  const std::string echo = "link: {port: /dev/ttyX, baud: 115200, echo: true}, poll_hz: 100, mode: bus";
  SimulatedBus bus(echo, "a: {bits: 14, address: 1}", "a: {start_deg: 90}");
  bus.Run(kSecond);
  EXPECT_EQ(bus.output().samples.back().counts, 4'096);
  EXPECT_THAT(bus.output().errors, IsEmpty());
}

TEST(SaaBusMode, EachFaultIsCountedByKindAndPassesOver) {
  const std::vector<std::pair<std::string, ErrorKind>> faults = {
      {"off", ErrorKind::kTimeout},
      {"garbage", ErrorKind::kChecksum},
      {"bit_flip:0.05", ErrorKind::kChecksum},
      {"request_flip:0.1", ErrorKind::kTimeout},
      {"short:1", ErrorKind::kShort},
      {"intermittent:0.5", ErrorKind::kTimeout},
      {"delayed:30", ErrorKind::kTimeout},
      {"slow:30000", ErrorKind::kTimeout},
  };
  for (const auto& [fault, kind] : faults) {
    SimulatedBus bus(kBus, "a: {bits: 14, address: 1}", "a: {start_deg: 90, fault: '" + fault + "'}");
    bus.Run(3 * kSecond);
    EXPECT_THAT(bus.Errors("a"), Contains(Key(kind))) << fault;
    bus.Set("a", "fault", "none");
    bus.Run(200 * kMillisecond);
    bus.output().samples.clear();
    bus.Run(kSecond);
    EXPECT_GT(bus.output().samples.size(), 95U) << fault;
    EXPECT_EQ(bus.output().samples.back().counts, 4'096) << fault;
  }
}

TEST(SaaBusMode, AStuckEncoderLooksLikeAShaftAtRest) {
  SimulatedBus bus(kBus, "a: {bits: 14, address: 1}", "a: {speed_rpm: 60}");
  bus.Run(kSecond);
  bus.Set("a", "fault", "stuck");
  bus.Run(100 * kMillisecond);
  bus.output().samples.clear();
  bus.Run(kSecond);
  EXPECT_EQ(bus.output().samples.front().counts, bus.output().samples.back().counts)
      << "software cannot distinguish them";
}

// 5.1.6 (1): "when control command is BC AA B1, its zero clearing command is BC AA C1".
TEST(SaaBusMode, ZeroIsOneCommandToItsEncoderAloneVerifiedByReading) {
  SimulatedBus bus(kBus + ", zero_clearing: true", kThree, kThreeSimulated);
  bus.Run(100 * kMillisecond);
  bus.Begin(0, "zero");
  bus.Run(2 * kSecond);
  int zeros = 0;
  for (const auto& [at, bytes] : bus.line->written) zeros += bytes.at(2) == 0xC1 ? 1 : 0;
  EXPECT_EQ(zeros, 1);
  EXPECT_EQ(bus.Count("a", "zeroings"), 1);
  EXPECT_EQ(bus.Count("b", "zeroings") + bus.Count("c", "zeroings"), 0);
  const Outcome& outcome = bus.outputs["a"].outcomes.back().second;
  EXPECT_EQ(outcome.state, CommandState::kSucceeded) << outcome.text;
  EXPECT_TRUE(outcome.verified);
  EXPECT_EQ(outcome.changes.at(0).before, "4096");
  EXPECT_EQ(outcome.changes.at(0).after, "0");
  EXPECT_EQ(bus.outputs["a"].jumps, 1);
  EXPECT_EQ(bus.outputs["a"].nv_writes, 1);
  EXPECT_THAT(bus.outputs["a"].errors, IsEmpty()) << "nothing answers it, and that is no error";
}

// Configured, but the encoder was purchased without it: 5.1.5.
TEST(SaaBusMode, ZeroOfAnEncoderWithoutZeroClearingFails) {
  SimulatedBus bus(kBus + ", zero_clearing: true", "a: {bits: 14, address: 1}",
                   "a: {start_deg: 90, zero_clearing: false}");
  bus.Run(100 * kMillisecond);
  bus.Begin(0, "zero");
  bus.Run(2 * kSecond);
  const Outcome& outcome = bus.output().outcomes.back().second;
  EXPECT_EQ(outcome.state, CommandState::kFailed);
  EXPECT_THAT(outcome.text, HasSubstr("is it the variant with zero clearing"));
}

TEST(SaaBusMode, ZeroWithoutZeroClearingInTheFileIsRefused) {
  SimulatedBus bus(kBus, "a: {bits: 14, address: 1}");
  bus.Run(100 * kMillisecond);
  bus.Begin(0, "zero");
  EXPECT_EQ(bus.output().outcomes.at(0).second.state, CommandState::kRejected);
  EXPECT_THAT(bus.output().outcomes.at(0).second.text, HasSubstr("set zero_clearing"));
}

TEST(SaaBusMode, OrdersToASilentEncoderAreRefused) {
  SimulatedBus bus(kBus + ", zero_clearing: true", "a: {bits: 14, address: 1}", "a: {fault: off}");
  bus.Run(kSecond);
  for (const char* operation : {"zero", "read_position"}) {
    bus.Begin(0, operation);
    EXPECT_EQ(bus.output().outcomes.back().second.state, CommandState::kRejected) << operation;
    EXPECT_THAT(bus.output().outcomes.back().second.text, HasSubstr("nothing is received"));
  }
}

TEST(SaaBusMode, ReadPositionShowsOneReading) {
  SimulatedBus bus(kBus, "a: {bits: 14, address: 1}", "a: {start_deg: 8.416}");
  bus.Run(kSecond);
  bus.Begin(0, "read_position");
  bus.Run(kSecond);
  const Outcome& outcome = bus.output().outcomes.back().second;
  EXPECT_EQ(outcome.state, CommandState::kSucceeded);
  EXPECT_EQ(outcome.changes.at(0).after, "383") << "5.1.1 (4)";
  EXPECT_THAT(outcome.text, HasSubstr("8.4155 deg"));
}

TEST(SaaBusMode, ReadPositionAfterZeroSaysWhetherItTookEffect) {
  SimulatedBus bus(kBus, "a: {bits: 14, address: 1}, b: {bits: 14, address: 2}", "a: {start_deg: 90}");
  bus.Run(kSecond);
  bus.Begin(0, "read_position", {{"after", "zero"}});
  bus.Begin(1, "read_position", {{"after", "zero"}});
  bus.Run(kSecond);
  EXPECT_EQ(bus.outputs["a"].outcomes.back().second.changes.at(1).after, "no_effect_seen");
  EXPECT_EQ(bus.outputs["b"].outcomes.back().second.changes.at(1).after, "reads_as_after");
  bus.outputs["a"].motion.standstill = false;
  bus.Begin(0, "read_position", {{"after", "zero"}});
  bus.Run(kSecond);
  EXPECT_EQ(bus.outputs["a"].outcomes.back().second.changes.at(1).after, "cannot_tell") << "it turns";
}

TEST(SaaBusMode, OneOrderAtATimeAndItCanBeCancelledBeforeItTouchesAnything) {
  SimulatedBus bus(kBus + ", zero_clearing: true", "a: {bits: 14, address: 1}");
  bus.Run(100 * kMillisecond);
  bus.Begin(0, "zero");
  bus.Begin(0, "read_position");
  EXPECT_THAT(bus.output().outcomes.back().second.text, HasSubstr("another command"));
  EXPECT_TRUE(bus.device().Cancel({1}, bus.clock.Now()));
  EXPECT_FALSE(bus.device().Cancel({1}, bus.clock.Now()));
  bus.Run(kSecond);
  EXPECT_EQ(bus.Count("a", "zeroings"), 0);
}

}  // namespace
}  // namespace axlecast::saa_serial
