#include "drivers/biss/family.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <string>

#include "tests/support/probe_run.h"

namespace axlecast::biss {
namespace {

using testing::HasSubstr;
using testing::IsEmpty;
using testing::SizeIs;

ProbeTrial Trial() { return biss_probe({}).at(0); }

// A transfer of 72 samples: idle, acknowledgement, start bit, the fixed 0, the frame, and low behind it.
ByteList Transfer(const std::string& frame) {
  std::string bits =
      "11"
      "000"
      "10" +
      frame;
  bits.resize(72, '0');
  ByteList bytes(9);
  for (std::size_t i = 0; i < bits.size(); ++i)
    bytes[i / 8] |= static_cast<std::uint8_t>((bits[i] - '0') << (7 - i % 8));
  return bytes;
}

// x^6 + x + 1 by long division, inverted: SAA manual 5.6.
std::string Check(const std::string& data) {
  std::string rest = data + "000000";
  const std::string divisor = "1000011";
  for (std::size_t i = 0; i + 6 < rest.size(); ++i) {
    if (rest[i] == '0') continue;
    for (std::size_t k = 0; k < divisor.size(); ++k) rest[i + k] = rest[i + k] == divisor[k] ? '0' : '1';
  }
  std::string check = rest.substr(data.size());
  for (char& bit : check) bit = bit == '0' ? '1' : '0';
  return check;
}

const std::string kPosition = "1000101011100011";  // SAA manual 5.6: 35555

TEST(BissProbe, FindsTheEncoderOfTheManualsExampleWhichWarns) {
  ASSERT_EQ(Check(kPosition + "10"), "001010") << "the tests' own check bits are those of the manual";
  ProbeBench bench;
  bench.AnswerAll(Transfer(kPosition + "10" + "001010"));
  const std::vector<ProbeHit> found = bench.Run(Trial());
  ASSERT_THAT(found, SizeIs(1));
  EXPECT_EQ(found[0].confidence, Confidence::kPossible);
  EXPECT_THAT(found[0].reason, HasSubstr("an error or a warning"));
  EXPECT_EQ(ValueOf(found[0].keys, "bits"), "16");
}

TEST(BissProbe, AHealthyOneThatStandsStillIsLikely) {
  ProbeBench bench;
  bench.AnswerAll(Transfer(kPosition + "11" + Check(kPosition + "11")));
  const std::vector<ProbeHit> found = bench.Run(Trial());
  ASSERT_THAT(found, SizeIs(1));
  EXPECT_EQ(found[0].confidence, Confidence::kLikely) << found[0].reason;
  EXPECT_EQ(ValueOf(found[0].keys, "bits"), "16");
  EXPECT_THAT(found[0].bus, IsEmpty());
}

TEST(BissProbe, SaysWhichEdgeItSampledOn) {
  ProbeBench bench;
  bench.AnswerAll(Transfer(kPosition + "11" + Check(kPosition + "11")));
  const std::vector<ProbeHit> found = bench.Run(biss_probe({}).at(1));
  ASSERT_THAT(found, SizeIs(1));
  EXPECT_EQ(ValueOf(found[0].bus, "sample_on"), "rising");
}

TEST(BissProbe, FindsNothingWithWrongCheckBitsOrWithoutAnAnswer) {
  for (const ByteList& answer : {Transfer(kPosition + "11" + "111111"), ByteList(9, 0xFF), ByteList(9, 0x00)}) {
    ProbeBench bench;
    bench.AnswerAll(answer);
    EXPECT_THAT(bench.Run(Trial()), IsEmpty());
  }
}

TEST(BissProbe, FindsNothingWhereTheLineDoesNotRestBehindTheFrame) {
  ProbeBench bench;
  bench.AnswerAll(Transfer(kPosition + "11" + Check(kPosition + "11") + "0110"));
  EXPECT_THAT(bench.Run(Trial()), IsEmpty());
}

}  // namespace
}  // namespace axlecast::biss
