#include "drivers/tsubaki_sc/register_map.h"

#include <gmock/gmock.h>

#include "drivers/tsubaki_sc/unit_test_support.h"

namespace axlecast::tsubaki_sc {
namespace {

// Guideline 10, notes 2: the addresses of all 21 curves.
TEST(RegisterMap, LogsStandWhereTheGuidelineSays) {
  for (int log = 0; log < 3; ++log) {
    for (int quantity = 0; quantity < 7; ++quantity) {
      const auto index = static_cast<std::size_t>(quantity);
      const Block block = LogBlock(static_cast<std::size_t>(log), index);
      EXPECT_EQ(block.first, 1000 * log + 1000 + 100 * quantity);
      EXPECT_EQ(block.count, 20);
      const auto place = LogPlaceOf(block);
      ASSERT_TRUE(place);
      EXPECT_EQ(place->log, static_cast<std::size_t>(log));
      EXPECT_EQ(place->quantity, index);
    }
  }
  EXPECT_FALSE(LogPlaceOf(kAnalog));
  EXPECT_FALSE(LogPlaceOf({modbus::Function::kReadInputRegisters, 1000, 19}));
  EXPECT_FALSE(LogPlaceOf({modbus::Function::kReadHoldingRegisters, 1000, 20}));
}

// Guideline 10: units of registers 100-106; temperature and acceleration are signed, the others are not.
TEST(RegisterMap, QuantitiesHaveTheirUnitAndSign) {
  const struct {
    std::size_t index;
    const char* name;
    float of_one;
    float of_ffff;
  } kRows[] = {{0, "voltage", 0.1F, 6553.5F},   {1, "current", 0.001F, 65.535F}, {2, "power", 0.1F, 6553.5F},
               {3, "temperature", 0.1F, -0.1F}, {4, "accel_x", 0.01F, -0.01F},   {5, "accel_y", 0.01F, -0.01F},
               {6, "accel_z", 0.01F, -0.01F}};
  for (const auto& row : kRows) {
    EXPECT_EQ(kQuantityTable[row.index].name, row.name);
    EXPECT_FLOAT_EQ(ToUnits(kQuantityTable[row.index], 1), row.of_one) << row.name;
    EXPECT_FLOAT_EQ(ToUnits(kQuantityTable[row.index], 0xFFFF), row.of_ffff) << row.name;
  }
  EXPECT_FLOAT_EQ(ToUnits(kQuantityTable[3], 0x8000), -3276.8F);
}

// No request may span a gap (guideline 7): 0-54 are covered once, in order.
TEST(RegisterMap, ParameterBlocksCoverAllAndNoMore) {
  int next = 0;
  for (const Block& block : kParameterBlocks) {
    EXPECT_EQ(block.first, next);
    EXPECT_LE(block.count, 20) << "a log has so many: more in one request is not documented";
    next += block.count;
  }
  EXPECT_EQ(next, 55);
}

TEST(RegisterMap, TellsWhatARequestReads) {
  EXPECT_EQ(BlockOf(WithCrc({1, 0x04, 0x00, 0x64, 0x00, 0x07})), kAnalog);
  EXPECT_EQ(BlockOf(WithCrc({1, 0x02, 0x00, 0x00, 0x00, 0x01})), kMains);
  EXPECT_EQ(BlockOf(WithCrc({9, 0x11})), kVersion);
  EXPECT_EQ(BlockOf(WithCrc({1, 0x05, 0x00, 0x64, 0xFF, 0x00})), std::nullopt);
  EXPECT_EQ(BlockOf(WithCrc({1, 0x06, 0x00, 0x36, 0x00, 0x02})), std::nullopt);
  EXPECT_EQ(BlockOf(WithCrc({1, 0x04, 0x00, 0x64, 0x00})), std::nullopt);
  EXPECT_EQ(BlockOf({}), std::nullopt);
}

TEST(RegisterMap, TextIsShownWithoutItsPadding) {
  EXPECT_EQ(RegisterText(ByteList{'S', 'C', '0', '1'}, CharacterOrder::kHighFirst), "SC01");
  EXPECT_EQ(RegisterText(ByteList{'C', 'S', '1', '0'}, CharacterOrder::kLowFirst), "SC01");
  EXPECT_EQ(RegisterText(ByteList{'A', 0, 0, 0}, CharacterOrder::kHighFirst), "A");
  EXPECT_EQ(RegisterText(ByteList{'A', ' ', ' ', ' '}, CharacterOrder::kHighFirst), "A");
  EXPECT_EQ(RegisterText(ByteList{'A', 0x1B, 0xFF, 'B'}, CharacterOrder::kHighFirst), "A??B");
  EXPECT_EQ(RegisterText({}, CharacterOrder::kHighFirst), "");
}

TEST(RegisterMap, VersionIsThatOfTheGuidelinesExample) {
  EXPECT_EQ(VersionText(ByteList{0x01, 0x00}), "1.0.0");
  EXPECT_EQ(VersionText(ByteList{0x12, 0x34}), "18.3.4");
}

// Guideline 5.
TEST(RegisterMap, ErrorCodesHaveTheMakersNames) {
  EXPECT_STREQ(ExceptionName(1), "function error");
  EXPECT_STREQ(ExceptionName(2), "address error");
  EXPECT_STREQ(ExceptionName(3), "data error");
  EXPECT_STREQ(ExceptionName(4), "login error");
  EXPECT_STREQ(ExceptionName(5), "unknown error");
}

}  // namespace
}  // namespace axlecast::tsubaki_sc
