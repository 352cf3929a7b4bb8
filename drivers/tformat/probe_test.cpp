#include "drivers/tformat/family.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/support/probe_run.h"

namespace axlecast::tformat {
namespace {

using testing::AnyOf;
using testing::Each;
using testing::HasSubstr;
using testing::IsEmpty;
using testing::SizeIs;

const ByteList kAskAll = {0x1A};
const ByteList kAskId = {0x92};

ProbeTrial Trial() { return tformat_probe({}).at(0); }

TEST(TFormatProbe, IsOneTrialAtTheOnlyRateOfTheSpec) {
  ASSERT_THAT(tformat_probe({}), SizeIs(1));
  EXPECT_EQ(Trial().line.baud, 2'500'000);  // spec 6.1
  EXPECT_TRUE(Trial().asks);
  EXPECT_THAT(tformat_probe({.rates = {9'600}}), IsEmpty());
}

TEST(TFormatProbe, FindsTheEncoderOfAPublicCapture) {
  ProbeBench bench;
  bench.Answer(kAskAll, {0x1A, 0x00, 0xA5, 0xA5, 0x00, 0x17, 0x88, 0x88, 0x00, 0x00, 0x0D});  // golden/captures.txt
  bench.Answer(kAskId, {0x92, 0x00, 0x17, 0x85});
  const std::vector<ProbeHit> found = bench.Run(Trial());
  ASSERT_THAT(found, SizeIs(1));
  EXPECT_EQ(found[0].confidence, Confidence::kSure) << found[0].reason;
  EXPECT_EQ(ValueOf(found[0].keys, "model"), "smart_abs_23");
  EXPECT_THAT(found[0].check, IsEmpty());
}

TEST(TFormatProbe, AsksReadoutsAlone) {
  ProbeBench bench;
  bench.Answer(kAskAll, {0x1A, 0x00, 0xA5, 0xA5, 0x00, 0x17, 0x88, 0x88, 0x00, 0x00, 0x0D});
  (void)bench.Run(Trial());
  EXPECT_THAT(bench.link.written(), Each(AnyOf(kAskAll, kAskId)));
}

TEST(TFormatProbe, AnUnknownEncoderIsCustomAndItsBitsAreToBeLookedUp) {
  ProbeBench bench;
  bench.Answer(kAskId, {0x92, 0x00, 0x2A, 0xB8});
  const std::vector<ProbeHit> found = bench.Run(Trial());
  ASSERT_THAT(found, SizeIs(1));
  EXPECT_EQ(ValueOf(found[0].keys, "model"), "custom");
  EXPECT_EQ(ValueOf(found[0].keys, "enid"), "0x2a");
  EXPECT_THAT(found[0].check, HasSubstr("bits"));
}

TEST(TFormatProbe, APositionThatTheModelCannotHaveMakesItDoubtful) {
  ProbeBench bench;  // ENID 0x11 has 17 bits (spec 6.3.3), and this ABS 23
  bench.Answer(kAskAll, {0x1A, 0x00, 0x6E, 0xC3, 0x58, 0x11, 0x00, 0x00, 0x00, 0x00, 0xFE});
  const std::vector<ProbeHit> found = bench.Run(Trial());
  ASSERT_THAT(found, SizeIs(1));
  EXPECT_NE(found[0].confidence, Confidence::kSure);
  EXPECT_EQ(ValueOf(found[0].keys, "model"), "custom");
}

TEST(TFormatProbe, FindsNothingWhereNothingAnswersAndEndsSoon) {
  ProbeBench bench;
  EXPECT_THAT(bench.Run(Trial()), IsEmpty());
  EXPECT_LE(bench.took, Trial().longest);
}

TEST(TFormatProbe, TakesNoDamagedReplyForAnEncoder) {
  ProbeBench bench;
  bench.AnswerAll({0x1A, 0x00, 0xA5, 0xA5, 0x00, 0x17, 0x88, 0x88, 0x00, 0x00, 0x0C});
  EXPECT_THAT(bench.Run(Trial()), IsEmpty());
}

}  // namespace
}  // namespace axlecast::tformat
