#include "drivers/ssi/family.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <string>

#include "tests/support/probe_run.h"

namespace axlecast::ssi {
namespace {

using testing::HasSubstr;
using testing::IsEmpty;
using testing::SizeIs;

ProbeTrial Trial() { return ssi_probe({}).at(0); }

// The idle level and 63 clocks: what `unit` repeats, or with `once` the unit and zeros.
ByteList Transfer(const std::string& unit, bool once = false) {
  std::string bits = "1" + unit;
  while (bits.size() < 64) bits += once ? "0" : unit;
  ByteList bytes(8);
  for (std::size_t i = 0; i < 64; ++i) bytes[i / 8] |= static_cast<std::uint8_t>((bits[i] - '0') << (7 - i % 8));
  return bytes;
}

const std::string kWord = "000111101111";  // SAA manual 5.5: 495 at 12 bits

TEST(SsiProbe, AWordThatComesAgainShowsItsLength) {
  ProbeBench bench;
  bench.AnswerAll(Transfer(kWord));
  const std::vector<ProbeHit> found = bench.Run(Trial());
  ASSERT_THAT(found, SizeIs(1));
  EXPECT_EQ(ValueOf(found[0].keys, "bits"), "12");
  EXPECT_EQ(found[0].confidence, Confidence::kPossible) << "it stood still";
  EXPECT_THAT(found[0].check, HasSubstr("code"));
}

TEST(SsiProbe, TwentyFiveBitsAndAZeroAreTheTree) {
  ProbeBench bench;
  bench.AnswerAll(
      Transfer("1010011100101110001010111"
               "0"));  // TWK SSI 4, 5
  const std::vector<ProbeHit> found = bench.Run(Trial());
  ASSERT_THAT(found, SizeIs(1));
  EXPECT_EQ(ValueOf(found[0].keys, "model"), "twk");
}

TEST(SsiProbe, ZerosBehindTheWordLeaveItsLengthOpen) {
  ProbeBench bench;
  bench.AnswerAll(Transfer("1101000110111", true));
  const std::vector<ProbeHit> found = bench.Run(Trial());
  ASSERT_THAT(found, SizeIs(1));
  EXPECT_EQ(found[0].confidence, Confidence::kPossible);
  EXPECT_THAT(found[0].device, HasSubstr("or more"));
  EXPECT_EQ(ValueOf(found[0].keys, "bits"), "13");
}

TEST(SsiProbe, NobodyACutWireAndNoiseAreNothing) {
  for (const ByteList& answer : {ByteList(8, 0xFF), ByteList(8, 0x00), Transfer("0", true),
                                 ByteList{0xA3, 0x51, 0x0F, 0x9C, 0x27, 0xE8, 0x44, 0xB1}}) {
    ProbeBench bench;
    bench.AnswerAll(answer);
    EXPECT_THAT(bench.Run(Trial()), IsEmpty());
  }
}

}  // namespace
}  // namespace axlecast::ssi
