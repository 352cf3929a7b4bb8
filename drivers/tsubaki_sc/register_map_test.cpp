#include "drivers/tsubaki_sc/register_map.h"

#include <gmock/gmock.h>

#include <nlohmann/json.hpp>

#include "drivers/tsubaki_sc/decode.h"
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
    const char* name;  // as `decode` and MOTOR have it
    double of_one;
    double of_ffff;
    double of_8000;
  } kRows[] = {{"voltage_v", 0.1, 6553.5, 3276.8},     {"current_a", 0.001, 65.535, 32.768},
               {"power_w", 0.1, 6553.5, 3276.8},       {"temperature_c", 0.1, -0.1, -3276.8},
               {"accel_x_mps2", 0.01, -0.01, -327.68}, {"accel_y_mps2", 0.01, -0.01, -327.68},
               {"accel_z_mps2", 0.01, -0.01, -327.68}};
  const auto all_registers = [](unsigned value) {
    ByteList reply = {1, 0x04, 14};
    for (int i = 0; i < 7; ++i) {
      reply.push_back(static_cast<std::uint8_t>(value >> 8U));
      reply.push_back(static_cast<std::uint8_t>(value));
    }
    bool usable = false;
    return nlohmann::json(Decode({{"start", "100"}}, WithCrc(reply), &usable));
  };
  for (const auto& row : kRows) {
    EXPECT_NEAR(all_registers(1).at(row.name).get<double>(), row.of_one, 1e-6) << row.name;
    EXPECT_NEAR(all_registers(0xFFFF).at(row.name).get<double>(), row.of_ffff, 1e-3) << row.name;
    EXPECT_NEAR(all_registers(0x8000).at(row.name).get<double>(), row.of_8000, 1e-3) << row.name;
  }
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
