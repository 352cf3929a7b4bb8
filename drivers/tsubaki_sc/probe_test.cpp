#include "drivers/tsubaki_sc/family.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <set>

#include "drivers/protocol/modbus/adu.h"
#include "drivers/tsubaki_sc/settings.h"
#include "tests/support/probe_run.h"

namespace axlecast::tsubaki_sc {
namespace {

using testing::HasSubstr;
using testing::IsEmpty;
using testing::SizeIs;

ByteList Sealed(const ByteList& frame) {
  const Frame sealed = modbus::Sealed(Frame(frame));
  return {sealed.data(), sealed.data() + sealed.size()};
}

ProbeTrial Addresses(int first, int last) {
  return tsubaki_sc_probe({.rates = {}, .first_address = first, .last_address = last}).at(0);
}

// Guideline 10 to 12.
const ByteList kAskStatus = Sealed({0x01, 0x04, 0x00, 0xC8, 0x00, 0x05});
const ByteList kAskProductCode = Sealed({0x01, 0x03, 0x01, 0x2C, 0x00, 0x02});
const ByteList kAskMfgNumber = Sealed({0x01, 0x03, 0x01, 0x5E, 0x00, 0x05});
const ByteList kAskVersion = {0x01, 0x11, 0xC0, 0x2C};
const ByteList kStatusReply = {0x01, 0x04, 0x0A, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0xD1, 0x7D};  // golden/frames.txt

TEST(ScProbe, IsOneTrialAtTheFixedRateAndParity) {
  ASSERT_THAT(tsubaki_sc_probe({}), SizeIs(1));
  const ProbeTrial trial = tsubaki_sc_probe({}).at(0);
  EXPECT_EQ(trial.line.baud, 9'600);
  EXPECT_EQ(trial.line.parity, Parity::kEven);
  EXPECT_THAT(tsubaki_sc_probe({.rates = {19'200}}), IsEmpty());
}

TEST(ScProbe, FindsAUnitAndWhatItSaysOfItself) {
  ProbeBench bench;
  bench.Answer(kAskStatus, kStatusReply);
  bench.Answer(kAskProductCode, Sealed({0x01, 0x03, 0x04, 'S', 'C', '0', '1'}));
  bench.Answer(kAskMfgNumber, Sealed({0x01, 0x03, 0x0A, '0', '0', '0', '0', '0', '0', '0', '0', '0', '7'}));
  bench.Answer(kAskVersion, {0x01, 0x11, 0x01, 0x00, 0x50, 0x4D});
  const std::vector<ProbeHit> found = bench.Run(Addresses(1, 2));
  ASSERT_THAT(found, SizeIs(1));
  EXPECT_EQ(found[0].confidence, Confidence::kSure) << found[0].reason;
  EXPECT_EQ(ValueOf(found[0].keys, "address"), "1");
  EXPECT_THAT(found[0].device, HasSubstr("SC01"));
  EXPECT_THAT(found[0].device, HasSubstr("0000000007"));
}

TEST(ScProbe, AUnitThatRefusesTheRestIsOnlyPossible) {
  ProbeBench bench;
  bench.Answer(kAskStatus, kStatusReply);
  bench.AnswerAll(Sealed({0x01, 0x83, 0x02}));
  const std::vector<ProbeHit> found = bench.Run(Addresses(1, 1));
  ASSERT_THAT(found, SizeIs(1));
  EXPECT_EQ(found[0].confidence, Confidence::kPossible);
}

TEST(ScProbe, NoRequestWritesAndNoneComesBeforeTheGuidelinesPause) {
  ProbeBench bench;
  bench.Answer(kAskStatus, kStatusReply);
  EXPECT_THAT(bench.Run(Addresses(1, 16)), SizeIs(1));
  std::set<std::uint8_t> functions;
  for (const ByteList& request : bench.link.written()) functions.insert(request.at(1));
  EXPECT_THAT(functions, testing::ElementsAre(0x03, 0x04, 0x11));
  const std::vector<MonoNs>& times = bench.link.write_times();
  for (std::size_t i = 1; i < times.size(); ++i) EXPECT_GE(times[i] - times[i - 1], kCommandPause);
}

TEST(ScProbe, EndsInItsTimeWhereNothingAnswers) {
  ProbeBench bench;
  EXPECT_THAT(bench.Run(Addresses(1, 16)), IsEmpty());
  EXPECT_LE(bench.took, Addresses(1, 16).longest);
}

}  // namespace
}  // namespace axlecast::tsubaki_sc
