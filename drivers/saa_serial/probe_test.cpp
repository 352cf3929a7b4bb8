#include "drivers/saa_serial/family.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>

#include "tests/support/probe_run.h"

namespace axlecast::saa_serial {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;
using testing::SizeIs;

const ByteList kManualFrame = {0xFF, 0x81, 0x01, 0x7F, 0x00};  // SAA manual 5.1.1: 383

ProbeTrial Streaming() { return saa_serial_probe({.rates = {115'200}}).at(0); }
ProbeTrial Polled(int first, int last) {
  return saa_serial_probe({.rates = {115'200}, .first_address = first, .last_address = last}).back();
}

// A frame each period for two seconds from now.
void Stream(ProbeBench& bench, const ByteList& frame, MonoNs period) {
  for (MonoNs at = period; at < 2 * kSecond; at += period) bench.link.ArriveAt(bench.clock.Now() + at, frame);
}

TEST(SaaStreamProbe, FindsTheStreamOfTheManualsExampleAndMeasuresItsRate) {
  ProbeBench bench;
  Stream(bench, kManualFrame, 5 * kMillisecond);
  const std::vector<ProbeHit> found = bench.Run(Streaming());
  ASSERT_THAT(found, SizeIs(1));
  EXPECT_EQ(found[0].confidence, Confidence::kSure) << found[0].reason;
  EXPECT_EQ(ValueOf(found[0].bus, "mode"), "timing");
  EXPECT_EQ(ValueOf(found[0].bus, "refresh_hz"), "200");
  EXPECT_EQ(ValueOf(found[0].keys, "bits"), "16");
  EXPECT_THAT(found[0].check, HasSubstr("10 to 16"));
  EXPECT_THAT(bench.link.written(), IsEmpty());
}

TEST(SaaStreamProbe, TellsTheNumberOfDataBytes) {
  ProbeBench bench;
  Stream(bench, {0xFF, 0x81, 0x03, 0x0D, 0x40, 0xD0}, 10 * kMillisecond);
  const std::vector<ProbeHit> found = bench.Run(Streaming());
  ASSERT_THAT(found, SizeIs(1));
  EXPECT_EQ(ValueOf(found[0].keys, "bits"), "24");
  EXPECT_THAT(found[0].check, HasSubstr("18 to 24"));
}

TEST(SaaStreamProbe, TakesNoOtherStreamForAnEncoder) {
  ProbeBench bench;
  Stream(bench, {0xFF, 0x81, 0x01, 0x7F, 0x01, 'h', 'e', 'l', 'l', 'o'}, 5 * kMillisecond);
  EXPECT_THAT(bench.Run(Streaming()), IsEmpty());
}

TEST(SaaStreamProbe, SilenceIsNothing) {
  ProbeBench bench;
  EXPECT_THAT(bench.Run(Streaming()), IsEmpty());
  EXPECT_LE(bench.took, Streaming().longest + 50 * kMillisecond);
}

TEST(SaaPolledProbe, IsTriedOnlyAtARateThatTheOperatorNames) {
  const auto asks = [](const ProbeTrial& trial) { return trial.asks; };
  const auto blind = saa_serial_probe({});
  EXPECT_TRUE(std::none_of(blind.begin(), blind.end(), asks));
  const auto named = saa_serial_probe({.rates = {115'200}, .parity = Parity::kOdd});
  EXPECT_EQ(std::count_if(named.begin(), named.end(), asks), 1);
  EXPECT_EQ(named.back().line.parity, Parity::kOdd);
}

TEST(SaaPolledProbe, FindsEncodersByTheirRepliesAndAsksForPositionsAlone) {
  ProbeBench bench;
  bench.Answer({0xBC, 0xAA, 0xB1}, {0xFF, 0xB1, 0x01, 0x7F, 0x30});  // SAA manual 5.1.5
  bench.Answer({0xBC, 0xAA, 0xB3}, {0x00, 0xFF, 0x81, 0x03, 0x0D, 0x40, 0xD0});
  const std::vector<ProbeHit> found = bench.Run(Polled(0, 15));
  ASSERT_THAT(found, SizeIs(2));
  EXPECT_EQ(found[0].confidence, Confidence::kSure);
  EXPECT_EQ(ValueOf(found[0].keys, "reply_header"), "address");
  EXPECT_EQ(ValueOf(found[0].keys, "address"), "1");
  EXPECT_EQ(found[1].confidence, Confidence::kLikely);
  EXPECT_EQ(ValueOf(found[1].keys, "address"), "3");
  EXPECT_EQ(ValueOf(found[1].keys, "bits"), "24");
  for (const ByteList& request : bench.link.written()) {
    ASSERT_THAT(request, SizeIs(3));
    EXPECT_EQ(request[2] & 0xF0, 0xB0) << "CX would clear it to zero";
  }
}

// All encoders send the header 81, so that only the time shows which one answered.
TEST(SaaPolledProbe, ALateAnswerIsNotTakenForThatOfTheNextAddress) {
  for (const MonoNs late : {45 * kMillisecond, 70 * kMillisecond, 130 * kMillisecond, 490 * kMillisecond}) {
    ProbeBench bench;
    bench.Answer({0xBC, 0xAA, 0xB1}, {0xFF, 0x81, 0x01, 0x7F, 0x00}, late);
    bench.Answer({0xBC, 0xAA, 0xB7}, {0xFF, 0x81, 0x03, 0x0D, 0x40, 0xD0});
    const std::vector<ProbeHit> found = bench.Run(Polled(0, 15));
    ASSERT_THAT(found, SizeIs(1)) << late;
    EXPECT_EQ(ValueOf(found[0].keys, "address"), "7");
    EXPECT_EQ(found[0].confidence, Confidence::kLikely) << found[0].reason;
  }
}

TEST(SaaPolledProbe, AnAnswerWithAnotherAddressOrAWrongSumIsNone) {
  ProbeBench bench;
  bench.Answer({0xBC, 0xAA, 0xB1}, {0xFF, 0xB2, 0x01, 0x7F, 0x31});
  bench.Answer({0xBC, 0xAA, 0xB2}, {0xFF, 0x81, 0x01, 0x7F, 0x01});
  EXPECT_THAT(bench.Run(Polled(0, 15)), IsEmpty());
}

}  // namespace
}  // namespace axlecast::saa_serial
