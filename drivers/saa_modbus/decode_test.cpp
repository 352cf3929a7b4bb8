// The output of `axlecast decode saa_modbus` for a frame: docs/decode.md and README.md.
#include "drivers/saa_modbus/family.h"

#include <gtest/gtest.h>

#include <nlohmann/json.hpp>
#include <string>

#include "drivers/saa/table_test_support.h"
#include "tests/support/golden_file.h"

namespace axlecast::saa_modbus {
namespace {

using Json = nlohmann::ordered_json;

Json Decoded(const std::string& hex, const DecodeSettings& settings = {}) {
  return Decode(settings, GoldenBytes(hex)).value();
}

// 5.1.7 (7): 8.4155 degrees.
TEST(SaaModbusDecode, TheManualsExample) {
  EXPECT_EQ(Decoded("01 03 02 01 7F F8 34", {{"bits", "14"}}),
            Json::parse(R"({"ok":true,"kind":"read_position_reply",
      "address":1,"counts":383,"angle_deg":8.41552734375})"));
  EXPECT_EQ(Decoded("01 03 02 01 7F F8 34"),
            Json::parse(R"({"ok":true,"kind":"read_position_reply","address":1,"counts":383})"))
      << "the resolution is not in the frame";
}

// 4.1, "Angular Resolution": one count is what each column of the table prints.
TEST(SaaModbusDecode, OneCountIsTheResolutionOfTheTable) {
  for (const saa::TableColumn& column : saa::kTable41) {
    const char* reply = column.bits <= 16 ? "01 03 02 00 01 79 84" : "01 03 04 00 00 00 01 3B F3";
    const Json json = Decoded(reply, {{"bits", std::to_string(column.bits)}});
    ASSERT_EQ(json["counts"], 1) << json;
    EXPECT_TRUE(saa::IsPrintedResolution(column, json["angle_deg"].get<double>() * 3'600)) << json;
  }
}

TEST(SaaModbusDecode, PositionsOfTwoToFourBytes) {
  EXPECT_EQ(Decoded("01 03 04 00 03 0D 40 0F 53", {{"bits", "18"}})["angle_deg"], 274.658203125);
  EXPECT_EQ(Decoded("01 03 03 01 E2 40 5D 1E", {{"bits", "17"}})["counts"], 123'456);
  EXPECT_EQ(Decoded("01 03 04 03 FF FF FF CB F7")["counts"], 67'108'863);
}

TEST(SaaModbusDecode, Requests) {
  const std::vector<std::pair<std::string, std::string>> rows = {
      {"01 03 00 00 00 01 84 0A", R"({"ok":true,"kind":"read_position_request","address":1,"registers":1})"},
      {"01 03 00 00 00 02 C4 0B", R"({"ok":true,"kind":"read_position_request","address":1,"registers":2})"},
      {"FF A0 40 38", R"({"ok":true,"kind":"query_address_request"})"},
      {"01 A1 02 D8 51", R"({"ok":true,"kind":"set_address_request","address":1,"new_address":2})"},
      {"01 CC 00 75 00", R"({"ok":true,"kind":"set_parameter_request_or_reply","address":1,"parameter":"zero"})"},
      {"01 CC 02 F4 C1",
       R"({"ok":true,"kind":"set_parameter_request_or_reply","address":1,"parameter":"negative"})"},
      {"01 CC 01 B4 C0",
       R"({"ok":true,"kind":"set_parameter_request_or_reply","address":1,"parameter":"positive"})"},
      {"01 CC 57 34 FE",
       R"({"ok":true,"kind":"set_parameter_request_or_reply","address":1,"parameter":"baud_57600"})"},
  };
  for (const auto& [hex, object] : rows) EXPECT_EQ(Decoded(hex), Json::parse(object)) << hex;
}

TEST(SaaModbusDecode, OtherReplies) {
  const std::vector<std::pair<std::string, std::string>> rows = {
      {"FF A0 01 30 F8", R"({"ok":true,"kind":"query_address_reply","address":1})"},
      {"FF A0 01 F8 30", R"({"ok":true,"kind":"query_address_reply","address":1})"},
      {"02 A1 C1 68", R"({"ok":true,"kind":"set_address_reply","address":2})"},
      {"01 83 02 C0 F1", R"({"ok":true,"kind":"read_position_exception","address":1,"exception":2})"},
  };
  for (const auto& [hex, object] : rows) EXPECT_EQ(Decoded(hex), Json::parse(object)) << hex;
}

TEST(SaaModbusDecode, ErrorWords) {
  const std::vector<std::array<std::string, 4>> rows = {
      // frame, bits, kind, error
      {"", "16", "unknown", "short"},
      {"01", "16", "unknown", "short"},
      {"01 03 02 01 7F F8", "16", "read_position_reply", "short"},
      {"01 03 00 00 00 01 84", "16", "read_position_request", "short"},
      {"01 03 02 01 7F F8 34 00", "16", "read_position_reply", "long"},
      {"FF A0 40 38 FF A0", "16", "query_address_reply", "long"},
      {"01 03 02 01 7F F8 35", "16", "read_position_reply", "checksum"},
      {"01 03 02 01 7F 34 F8", "16", "read_position_reply", "checksum"},
      {"FF A0 38 40", "16", "query_address_request", "checksum"},
      {"FF A0 01 30 F9", "16", "query_address_reply", "checksum"},
      {"01 CC 02 C1 F4", "16", "set_parameter_request_or_reply", "checksum"},
      {"01 04 02 01 7F F9 40", "16", "unknown", "function"},
      {"01 03 02 40 00 89 84", "14", "read_position_reply", "range"},
      {"01 03 02 01 7F F8 34", "20", "read_position_reply", "range"},
      {"01 03 04 04 00 00 00 FB 03", "26", "read_position_reply", "range"},
      {"01 03 01 05 30 4B", "16", "read_position_reply", "range"},
      {"01 03 05 01 02 03 04 05 BC 29", "16", "read_position_reply", "range"},
      {"01 03 00 00 00 03 05 CB", "16", "read_position_request", "range"},
      {"01 A1 F8 58 12", "16", "set_address_request", "range"},
      {"F8 03 02 7A A6 87 4A", "15", "read_position_reply", "range"},
      {"00 03 02 01 7F C5 F4", "14", "read_position_reply", "range"},
      {"FE 83 02 F0 C1", "14", "read_position_exception", "range"},
      {"F8 A1 83 C8", "14", "set_address_reply", "range"},
      {"01 CC 03 35 01", "16", "set_parameter_request_or_reply", "range"},
      {"FF A0 F8 72 38", "16", "query_address_reply", "range"},
  };
  for (const auto& [hex, bits, kind, error] : rows) {
    EXPECT_EQ(Decoded(hex, {{"bits", bits}}), (Json{{"ok", false}, {"kind", kind}, {"error", error}})) << hex;
  }
}

TEST(SaaModbusDecode, RefusesOtherSettings) {
  const std::vector<std::array<std::string, 3>> rows = {
      {"bits", "9", "bits=9: expected 10..26"},
      {"bits", "27", "bits=27: expected 10..26"},
      {"bits", "x", "bits=x: expected 10..26"},
      {"enid", "17", "unknown key 'enid': saa_modbus accepts bits"}};
  for (const auto& [key, value, said] : rows) {
    const std::string error = ErrorText(Decode({{key, value}}, {}));
    EXPECT_TRUE(error.starts_with(said)) << error;
  }
}

}  // namespace
}  // namespace axlecast::saa_modbus
