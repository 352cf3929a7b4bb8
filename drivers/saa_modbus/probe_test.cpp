#include "drivers/saa_modbus/family.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <set>

#include "drivers/protocol/modbus/adu.h"
#include "tests/support/probe_run.h"

namespace axlecast::saa_modbus {
namespace {

using testing::HasSubstr;
using testing::IsEmpty;
using testing::SizeIs;

ByteList Sealed(const ByteList& frame) {
  const Frame sealed = modbus::Sealed(Frame(frame));
  return {sealed.data(), sealed.data() + sealed.size()};
}

ProbeTrial First(int first, int last) {
  return saa_modbus_probe({.rates = {19'200}, .first_address = first, .last_address = last}).at(0);
}

const ByteList kOneRegister = {0x01, 0x03, 0x00, 0x00, 0x00, 0x01, 0x84, 0x0A};  // SAA manual 5.1.7 (5) 1
const ByteList kTwoRegisters = {0x01, 0x03, 0x00, 0x00, 0x00, 0x02, 0xC4, 0x0B};
const ByteList kPosition = {0x01, 0x03, 0x02, 0x01, 0x7F, 0xF8, 0x34};  // 383

TEST(SaaModbusProbe, FindsTheEncoderOfTheManualsExample) {
  ProbeBench bench;
  bench.Answer(kOneRegister, kPosition);
  const std::vector<ProbeHit> found = bench.Run(First(1, 3));
  ASSERT_THAT(found, SizeIs(1));
  EXPECT_EQ(found[0].confidence, Confidence::kLikely) << found[0].reason;
  EXPECT_EQ(ValueOf(found[0].keys, "address"), "1");
  EXPECT_EQ(ValueOf(found[0].keys, "bits"), "16");
  EXPECT_THAT(found[0].check, HasSubstr("10 to 16"));
}

TEST(SaaModbusProbe, FindsAnEncoderOfManyBitsByItsTwoRegisters) {
  ProbeBench bench;
  bench.Answer(kTwoRegisters, {0x01, 0x03, 0x04, 0x00, 0x03, 0x0D, 0x40, 0x0F, 0x53});  // golden/replies.txt
  const std::vector<ProbeHit> found = bench.Run(First(1, 1));
  ASSERT_THAT(found, SizeIs(1));
  EXPECT_EQ(ValueOf(found[0].keys, "bits"), "26");
  EXPECT_THAT(found[0].check, HasSubstr("18 to 26"));  // 200,000 takes 18
}

TEST(SaaModbusProbe, ThreeDataBytesAreTwentyFourBitsAtMost) {
  ProbeBench bench;
  bench.Answer(kTwoRegisters, {0x01, 0x03, 0x03, 0x01, 0xE2, 0x40, 0x5D, 0x1E});  // golden/replies.txt
  const std::vector<ProbeHit> found = bench.Run(First(1, 1));
  ASSERT_THAT(found, SizeIs(1));
  EXPECT_EQ(ValueOf(found[0].keys, "bits"), "24");
}

TEST(SaaModbusProbe, ADeviceThatKnowsInputRegistersIsAnotherOne) {
  ProbeBench bench;
  bench.Answer(kOneRegister, kPosition);
  bench.Answer(Sealed({0x01, 0x04, 0x00, 0x00, 0x00, 0x01}), Sealed({0x01, 0x04, 0x02, 0x00, 0x00}));
  const std::vector<ProbeHit> found = bench.Run(First(1, 1));
  ASSERT_THAT(found, SizeIs(1));
  EXPECT_THAT(found[0].keys, IsEmpty());
  EXPECT_THAT(found[0].device, HasSubstr("another Modbus device"));
}

TEST(SaaModbusProbe, ADeviceThatRefusesIsAnotherOne) {
  ProbeBench bench;
  bench.Answer(kOneRegister, Sealed({0x01, 0x83, 0x02}));
  const std::vector<ProbeHit> found = bench.Run(First(1, 1));
  ASSERT_THAT(found, SizeIs(1));
  EXPECT_THAT(found[0].keys, IsEmpty());
}

TEST(SaaModbusProbe, FindsNothingInNoise) {
  ProbeBench bench;
  bench.AnswerAll({0x01, 0x03, 0x02, 0x01, 0x7F, 0xF8, 0x35});
  EXPECT_THAT(bench.Run(First(1, 8)), IsEmpty());
}

TEST(SaaModbusProbe, EndsInItsTimeWhereNothingAnswers) {
  ProbeBench bench;
  EXPECT_THAT(bench.Run(First(1, 32)), IsEmpty());
  EXPECT_LE(bench.took, First(1, 32).longest);
  EXPECT_THAT(bench.link.written(), SizeIs(64));
}

// The functions of an SAA encoder that write are A1 and CC, those of Modbus 05, 06, 0F and 10; and `BC AA CX` on the same
// line would clear an encoder of another kind to zero.
TEST(SaaModbusProbe, NoRequestWritesWhateverAnswers) {
  std::set<std::uint8_t> functions;
  ByteList all;
  for (const ProbeTrial& trial : saa_modbus_probe({.rates = {57'600}})) {
    ProbeBench bench;
    bench.Answer(kOneRegister, kPosition);
    (void)bench.Run(trial);
    for (const ByteList& request : bench.link.written()) {
      functions.insert(request.at(1));
      all.insert(all.end(), request.begin(), request.end());
    }
  }
  EXPECT_THAT(functions, testing::ElementsAre(0x03, 0x04));
  for (std::size_t i = 2; i < all.size(); ++i) {
    EXPECT_FALSE(all[i - 2] == 0xBC && all[i - 1] == 0xAA && (all[i] & 0xF0) == 0xC0) << "at byte " << i;
  }
}

TEST(SaaModbusProbe, TriesTheRatesOfTheManualAndNoOther) {
  std::set<std::int64_t> rates;
  for (const ProbeTrial& trial : saa_modbus_probe({})) rates.insert(trial.line.baud);
  EXPECT_THAT(rates, testing::ElementsAre(2'400, 4'800, 9'600, 19'200, 57'600));
  EXPECT_EQ(saa_modbus_probe({}).at(0).line.baud, 19'200);  // as delivered
  EXPECT_THAT(saa_modbus_probe({.rates = {115'200}}), IsEmpty());
}

}  // namespace
}  // namespace axlecast::saa_modbus
