#include "drivers/tsubaki_sc/register_map.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include "drivers/tsubaki_sc/family.h"
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
    return nlohmann::json(Decode({{"start", "100"}}, WithCrc(reply)).value());
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

ByteList ListOf(const Frame& frame) { return {frame.data(), frame.data() + frame.size()}; }

// Guideline 5, error 03, and 11: 8 to 16 characters from ! to ~.
TEST(Password, HasEightToSixteenPrintableCharacters) {
  EXPECT_TRUE(IsPassword("password"));
  EXPECT_TRUE(IsPassword("!~!~!~!~!~!~!~!~"));
  EXPECT_FALSE(IsPassword("passwor"));
  EXPECT_FALSE(IsPassword("12345678901234567"));
  EXPECT_FALSE(IsPassword("pass word"));
  EXPECT_FALSE(IsPassword("passw\x7Frd"));
  EXPECT_FALSE(IsPassword("passw\xC3\xB6rd"));
  EXPECT_FALSE(IsPassword(""));
}

TEST(Password, StandsInEightRegistersPaddedAsConfigured) {
  const ByteList head = {3, 0x10, 0x00, 0x64, 0x00, 0x08, 0x10};
  const auto written = [&](const PasswordFormat& format) {
    return ListOf(WritePassword(3, kLoginBlock, "passwords", format));
  };
  ByteList expected = head;
  for (const char c : std::string("passwords\0\0\0\0\0\0\0", 16)) expected.push_back(static_cast<std::uint8_t>(c));
  EXPECT_EQ(written({}), WithCrc(expected));
  expected = head;
  for (const char c : std::string("apssowdr s      ")) expected.push_back(static_cast<std::uint8_t>(c));
  EXPECT_EQ(written({.order = CharacterOrder::kLowFirst, .padding = 0x20}), WithCrc(expected));
  EXPECT_EQ(ListOf(WritePassword(1, kPassword, "password", {}))[3], 200);
}

TEST(Password, IsComparedWhateverPadsIt) {
  const auto holds = [](const std::string& registers, std::string_view text) {
    return HoldsPassword(ByteList(registers.begin(), registers.end()), text, CharacterOrder::kHighFirst);
  };
  const std::string nul(8, '\0');
  EXPECT_TRUE(holds("password" + nul, "password"));
  EXPECT_TRUE(holds("password        ", "password"));
  EXPECT_FALSE(holds("passwore" + nul, "password"));
  EXPECT_FALSE(holds("passwords" + nul.substr(1), "password")) << "a longer one that begins so";
  EXPECT_FALSE(holds("password" + nul, "passwords"));
  EXPECT_FALSE(holds("password", "password")) << "half of the registers";
  EXPECT_FALSE(holds("", "password"));
}

TEST(Password, IsGoneWhenWiped) {
  Frame frame = WritePassword(1, kLoginBlock, "password", {});
  Wipe(frame);
  EXPECT_TRUE(frame.empty());
  for (std::size_t i = 0; i < 32; ++i) EXPECT_EQ(frame.data()[i], 0) << i;
}

TEST(RegisterMap, BehindTheLastCurveIsNone) {
  const Block last = LogBlock(kLogs - 1, kQuantities - 1);
  EXPECT_TRUE(LogHolding(last));
  EXPECT_FALSE(LogHolding({last.read, 1700, last.count}));
  EXPECT_FALSE(LogHolding({last.read, 4000, last.count}));
}

TEST(RegisterMap, TextHasWholeRegistersOfPrintableCharacters) {
  EXPECT_EQ(RegisterText(ByteList{'A', 'B', 'C'}, CharacterOrder::kHighFirst), "AB");
  EXPECT_EQ(RegisterText(ByteList{'A', 0x7F, 0x7E, 0x1F}, CharacterOrder::kHighFirst), "A?~?");
}

}  // namespace

}  // namespace axlecast::tsubaki_sc
