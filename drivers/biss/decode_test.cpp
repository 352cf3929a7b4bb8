#include "drivers/biss/family.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <nlohmann/json.hpp>

#include "drivers/biss/bits_test_support.h"
#include "drivers/saa/table_test_support.h"
#include "tests/support/golden_file.h"

namespace axlecast::biss {
namespace {

using ::testing::HasSubstr;

// As the command line gives bits: the number of them is a setting.
std::string Bits(const std::string& text, DecodeSettings settings = {}) {
  settings.emplace_back("bit_count", std::to_string(CountOf(text)));
  const auto json = Decode(settings, BytesOf(text));
  return json ? json->dump() : json.error().text;
}
std::string Hex(const std::string& text, const DecodeSettings& settings = {}) {
  const auto json = Decode(settings, GoldenBytes(text));
  return json ? json->dump() : json.error().text;
}
std::string Problem(const DecodeSettings& settings) { return ErrorText(Decode(settings, {})); }
std::string Bad(const std::string& error) {
  return R"({"ok":false,"kind":"position_frame","error":")" + error + R"("})";
}

TEST(BissDecode, TheManualsExample) {
  const std::string decoded =
      R"({"ok":true,"kind":"position_frame","counts":35555,"angle_deg":195.3094482421875,"alarms":["warning"]})";
  EXPECT_EQ(Bits("1000101011100011 10 001010", {{"bits", "16"}}), decoded);
  EXPECT_EQ(Hex("8A E3 8A", {{"bits", "16"}}), decoded);
  EXPECT_EQ(Hex("8A E3 8A"), decoded) << "16 bits if no length is given";
}

// 4.1, "Angular Resolution": one count is what each column of the table prints.
TEST(BissDecode, OneCountIsTheResolutionOfTheTable) {
  for (const saa::TableColumn& column : saa::kTable41) {
    const nlohmann::json json =
        nlohmann::json::parse(Bits(FrameText(1, column.bits), {{"bits", std::to_string(column.bits)}}));
    ASSERT_EQ(json.at("counts"), 1) << json;
    EXPECT_TRUE(saa::IsPrintedResolution(column, json.at("angle_deg").get<double>() * 3'600)) << json;
  }
}

TEST(BissDecode, EveryCapture) {
  for (const GoldenRow& row : GoldenRows(__FILE__, "frames.txt", 4)) {
    const nlohmann::json json = nlohmann::json::parse(Bits(row.columns[1], {{"bits", row.columns[0]}}));
    EXPECT_TRUE(json.at("ok")) << row.where;
    EXPECT_EQ(std::to_string(json.at("counts").get<int>()), row.columns[2]) << row.where;
    const auto alarms = json.at("alarms").get<std::vector<std::string>>();
    EXPECT_EQ(alarms.empty() ? "good" : alarms[0], row.columns[3]) << row.where;
  }
  EXPECT_EQ(Hex("FF 84 50 80 00", {{"bits", "19"}}), Bad("long"));
  EXPECT_THAT(Hex("FF 84 4A 00", {{"bits", "19"}}), HasSubstr(R"("counts":523298)"))
      << "27 bits, filled up with zeros";
}

TEST(BissDecode, Turns) {
  EXPECT_THAT(Bits(FrameText(0xA5'123, 20), {{"bits", "12"}, {"turn_bits", "8"}}),
              HasSubstr(R"("counts":291,"turns":165,"angle_deg":25.576171875,"alarms":[])"));
}

TEST(BissDecode, BothStatusBits) {
  EXPECT_THAT(Bits(FrameText(5, 16, "00")), HasSubstr(R"("alarms":["error","warning"])"));
}

TEST(BissDecode, Errors) {
  EXPECT_EQ(Bits("1000101011100011 10 00101"), Bad("short"));
  EXPECT_EQ(Bits("1000101011100011 10 0010100"), Bad("long"));
  EXPECT_EQ(Bits("1000101011100011 10 001011"), Bad("checksum"));
  EXPECT_EQ(Bits("1000101011100011 10 110101"), Bad("checksum")) << "not inverted";
  EXPECT_EQ(Hex("8A E3"), Bad("short"));
  EXPECT_EQ(Hex("8A E3 8A 00"), Bad("long"));
  EXPECT_EQ(Hex("FF 84 4A 01", {{"bits", "19"}}), Bad("range")) << "what fills the last byte is 0";
  EXPECT_EQ(Hex(""), Bad("short"));
}

TEST(BissDecode, AWholeTransfer) {
  const DecodeSettings transfer = {{"frame", "transfer"}};
  EXPECT_EQ(Bits("1110 00 10 1000101011100011 10 001010 0", transfer),
            R"({"ok":true,"kind":"transfer","counts":35555,"angle_deg":195.3094482421875,"alarms":["warning"],)"
            R"("ack_at":3,"start_at":6})");
  const auto bad = [&](const std::string& text) { return Bits(text, transfer); };
  EXPECT_EQ(bad("111111111111"), R"({"ok":false,"kind":"transfer","error":"no_ack"})");
  EXPECT_EQ(bad("110000000000"), R"({"ok":false,"kind":"transfer","error":"no_start"})");
  EXPECT_EQ(bad("010010"), R"({"ok":false,"kind":"transfer","error":"line_low"})");
  EXPECT_EQ(bad("110011"), R"({"ok":false,"kind":"transfer","error":"range","ack_at":2,"start_at":4})");
  EXPECT_EQ(bad("110010 1000101011100011 10 00101"),
            R"({"ok":false,"kind":"transfer","error":"short","ack_at":2,"start_at":4})")
      << "the zeros that fill the last byte are none of it";
  EXPECT_EQ(bad("110010 1000101011100011 10 001011"),
            R"({"ok":false,"kind":"transfer","error":"checksum","ack_at":2,"start_at":4})");
}

TEST(BissDecode, AnotherCheck) {
  const std::string covered = "1000101011100011 11";
  const std::string text = covered + NaiveCrc(covered, 0x11D, 8, 0xFF, false);
  for (const char* poly : {"0x11D", "0x1D", "285"}) {
    EXPECT_THAT(
        Bits(text, {{"crc_bits", "8"}, {"crc_poly", poly}, {"crc_start", "0xFF"}, {"crc_inverted", "false"}}),
        HasSubstr(R"("counts":35555)"))
        << poly;
  }
}

TEST(BissDecode, WrongSettingsAreNamed) {
  EXPECT_THAT(Problem({{"bits", "33"}}), HasSubstr("bits=33: expected 10..32"));
  EXPECT_THAT(Problem({{"bits", "32"}, {"turn_bits", "24"}}), HasSubstr("more than 52"));
  EXPECT_THAT(Problem({{"crc_poly", "0x42"}}), HasSubstr("x^6 + x + 1 is 0x43"));
  EXPECT_THAT(Problem({{"crc_bits", "8"}, {"crc_poly", "0x243"}}), HasSubstr("crc_bits=8"));
  EXPECT_THAT(Problem({{"crc_start", "64"}}), HasSubstr("crc_start=64"));
  EXPECT_THAT(Problem({{"crc_inverted", "yes"}}), HasSubstr("false or true"));
  EXPECT_THAT(Problem({{"frame", "bare"}}), HasSubstr("position or transfer"));
  EXPECT_THAT(Problem({{"bit_count", "many"}}), HasSubstr("bit_count=many"));
  EXPECT_THAT(Problem({{"gray", "true"}}), HasSubstr("biss accepts bits, turn_bits"));
}

}  // namespace
}  // namespace axlecast::biss
