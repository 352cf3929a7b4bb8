#include "drivers/tformat/encoder_model.h"

#include <gtest/gtest.h>

#include <map>
#include <vector>

namespace axlecast::tformat {
namespace {

using Verdict = SimulatedRequest::Verdict;

SimulatedRequest Check(const std::vector<std::uint8_t>& bytes, bool complete = false) {
  return CheckRequest(bytes, complete);
}

// TS5669 spec Table 1 as bytes; TI's C2000 T-format library prints the same (0x02, 0x8A, 0x92, 0x1A, ...).
const std::map<std::uint8_t, std::uint8_t> kFields = {{0x0, 0x02}, {0x1, 0x8A}, {0x2, 0x92},
                                                      {0x3, 0x1A}, {0x6, 0x32}, {0x7, 0xBA},
                                                      {0x8, 0xC2}, {0xC, 0x62}, {0xD, 0xEA}};

TEST(SimulatorRequestTest, ControlFieldsOfTable1) {
  for (const auto& [id, field] : kFields) EXPECT_EQ(TableControlField(id), field) << int{id};
}

TEST(SimulatorRequestTest, ReadoutsAndResetsAreOneByte) {
  for (const std::uint8_t id : std::initializer_list<std::uint8_t>{0x0, 0x1, 0x2, 0x3, 0x7, 0x8, 0xC}) {
    const SimulatedRequest request = Check({kFields.at(id)});
    EXPECT_EQ(request.verdict, Verdict::kGood) << int{id};
    EXPECT_EQ(request.data_id, id);
    EXPECT_EQ(request.size, 1U);
  }
}

TEST(SimulatorRequestTest, EepromRequestsCarryAddressDataAndCrc) {
  const SimulatedRequest read = Check({0xEA, 0x00, 0xEA});
  EXPECT_EQ(read.verdict, Verdict::kGood);
  EXPECT_EQ(read.address, 0);
  const SimulatedRequest write = Check({0x32, 0x00, 0x55, 0x67});
  EXPECT_EQ(write.verdict, Verdict::kGood);
  EXPECT_EQ(write.data, 0x55);
  EXPECT_EQ(write.size, 4U);
}

TEST(SimulatorRequestTest, TheRestOfAnEepromRequestIsAwaited) {
  EXPECT_EQ(Check({0xEA}).verdict, Verdict::kIncomplete);
  EXPECT_EQ(Check({0xEA, 0x00}).verdict, Verdict::kIncomplete);
  EXPECT_EQ(Check({0x32, 0x00, 0x55}).verdict, Verdict::kIncomplete);
  EXPECT_EQ(Check({0x32, 0x00, 0x55}, true).verdict, Verdict::kAbnormal);
}

// Of the 256 first bytes 32 have the sink code 0 1 0; 9 of these are Table 1's; 16 have a wrong parity.
TEST(SimulatorRequestTest, EveryFirstByte) {
  std::map<Verdict, int> verdicts;
  int parity_errors = 0;
  for (unsigned byte = 0; byte < 256; ++byte) {
    const SimulatedRequest request = Check({static_cast<std::uint8_t>(byte)});
    ++verdicts[request.verdict];
    EXPECT_EQ(request.verdict == Verdict::kNoSync, (byte & 7U) != 2U) << byte;
    parity_errors += request.parity_error ? 1 : 0;
  }
  EXPECT_EQ(verdicts[Verdict::kGood], 7);
  EXPECT_EQ(verdicts[Verdict::kIncomplete], 2);
  EXPECT_EQ(verdicts[Verdict::kAbnormal], 23);
  EXPECT_EQ(parity_errors, 16);
}

// Spec Table 6.
TEST(SimulatorRequestTest, ClosedAddressesAndWrongCrcAreAbnormal) {
  EXPECT_EQ(Check({0xEA, 79, 0xEA ^ 79}).verdict, Verdict::kGood);
  EXPECT_EQ(Check({0xEA, 80, 0xEA ^ 80}).verdict, Verdict::kAbnormal);
  EXPECT_EQ(Check({0xEA, 0x80, 0xEA ^ 0x80}).verdict, Verdict::kAbnormal) << "busy bit in a request";
  EXPECT_EQ(Check({0xEA, 0x00, 0xEB}).verdict, Verdict::kAbnormal);
  EXPECT_EQ(Check({0x32, 0x00, 0x55, 0x66}).verdict, Verdict::kAbnormal);
}

TEST(SimulatorRequestTest, EverySingleBitErrorOfAnEepromWriteIsFound) {
  const std::vector<std::uint8_t> good = {0x32, 0x11, 0x55, 0x32 ^ 0x11 ^ 0x55};
  for (std::size_t bit = 0; bit < 32; ++bit) {
    std::vector<std::uint8_t> bytes = good;
    bytes[bit / 8] = static_cast<std::uint8_t>(bytes[bit / 8] ^ 1U << bit % 8);
    EXPECT_NE(Check(bytes).verdict, Verdict::kGood) << bit;
  }
}

}  // namespace
}  // namespace axlecast::tformat
