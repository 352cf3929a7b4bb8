// The output of `axlecast decode saa_serial`: README.md, "Decoding".
#include "drivers/saa_serial/family.h"

#include <gtest/gtest.h>

#include <nlohmann/json.hpp>
#include <string>

#include "drivers/saa/table_test_support.h"
#include "tests/support/golden_file.h"

namespace axlecast::saa_serial {
namespace {

using Json = nlohmann::ordered_json;

Json Decoded(const std::string& hex, const DecodeSettings& settings = {}) {
  return Decode(settings, GoldenBytes(hex)).value();
}

TEST(SaaDecode, TheManualsExample) {
  EXPECT_EQ(Decoded("FF 81 01 7F 00"), Json::parse(R"({"ok":true,"kind":"position_reply","counts":383,
      "angle_deg":8.41552734375})"));
  EXPECT_EQ(Decoded("FF 81 01 7F 00", {{"bits", "16"}})["angle_deg"], 383 * 360.0 / 65'536);
}

TEST(SaaDecode, GoldenRepliesHaveTheirErrorWord) {
  for (const GoldenRow& row : GoldenRows(__FILE__, "replies.txt", 5)) {
    // A frame alone is judged with either header.
    if (row.columns[2] != "either" && row.columns[4] == "error=header") continue;
    const Json json = Decoded(row.columns[0], {{"bits", row.columns[1]}, {"address", "0x" + row.columns[3]}});
    if (!row.columns[4].starts_with("error=")) {
      EXPECT_EQ(json["counts"], std::stoul(row.columns[4])) << row.where;
      continue;
    }
    std::string word = row.columns[4].substr(6);
    if (word == "header") word = "wrong_identity";
    if (word == "start") word = "header";
    EXPECT_EQ(json["error"], word) << row.where;
    EXPECT_FALSE(json.contains("counts") || json.contains("angle_deg")) << row.where;
  }
}

// 5.1.5 (1): "The second byte of returned data is product address number".
TEST(SaaDecode, RepliesWithAnAddress) {
  EXPECT_EQ(Decoded("FF B1 01 7F 30"), Json::parse(R"({"ok":true,"kind":"position_reply","counts":383,
      "angle_deg":8.41552734375,"address":"0xb1"})"));
  EXPECT_EQ(Decoded("FF B1 01 7F 30", {{"address", "1"}})["ok"], true);
  EXPECT_EQ(Decoded("FF B2 01 7F 31", {{"address", "1"}})["error"], "wrong_identity");
  EXPECT_EQ(Decoded("FF 81 01 7F 00", {{"address", "1"}})["ok"], true);
}

// 4.1, "Angular Resolution": one count is what each column of the table prints.
TEST(SaaDecode, OneCountIsTheResolutionOfTheTable) {
  for (const saa::TableColumn& column : saa::kTable41) {
    const char* frame = column.bits <= 16   ? "FF 81 00 01 81"
                        : column.bits <= 24 ? "FF 81 00 00 01 81"
                                            : "FF 81 00 00 00 01 81";
    const Json json = Decoded(frame, {{"bits", std::to_string(column.bits)}});
    ASSERT_EQ(json["counts"], 1) << json;
    EXPECT_TRUE(saa::IsPrintedResolution(column, json["angle_deg"].get<double>() * 3'600)) << json;
  }
}

// Six and seven bytes do not show the resolution: counts, but no angle.
TEST(SaaDecode, WithoutItsResolutionALongFrameHasNoAngle) {
  EXPECT_EQ(Decoded("FF 81 12 34 56 1C"), Json::parse(R"({"ok":true,"kind":"position_reply","counts":1193046})"));
  EXPECT_EQ(Decoded("FF 81 01 23 45 67 50")["counts"], 19'088'743);
  EXPECT_TRUE(Decoded("FF 81 12 34 56 1C", {{"bits", "24"}}).contains("angle_deg"));
}

TEST(SaaDecode, Requests) {
  EXPECT_EQ(Decoded("BC AA B1"), Json::parse(R"({"ok":true,"kind":"read_position_request","command":"0xb1"})"));
  EXPECT_EQ(Decoded("BC AA C1"), Json::parse(R"({"ok":true,"kind":"zero_request","command":"0xc1"})"));
  EXPECT_EQ(Decoded("BC AA 33"), Json::parse(R"({"ok":true,"kind":"request","command":"0x33"})"));
  EXPECT_EQ(Decoded("BC AA"), Json::parse(R"({"ok":false,"kind":"request","error":"short"})"));
  EXPECT_EQ(Decoded("BC AA B1 00"), Json::parse(R"({"ok":false,"kind":"request","error":"long"})"));
  EXPECT_EQ(Decoded("BC AB B1"), Json::parse(R"({"ok":false,"kind":"request","error":"header"})"));
}

TEST(SaaDecode, FramesThatAreNone) {
  EXPECT_EQ(Decoded(""), Json::parse(R"({"ok":false,"kind":"unknown","error":"short"})"));
  EXPECT_EQ(Decoded("81 01 7F 00"), Json::parse(R"({"ok":false,"kind":"unknown","error":"header"})"));
  EXPECT_EQ(Decoded("FF"), Json::parse(R"({"ok":false,"kind":"position_reply","error":"short"})"));
}

TEST(SaaDecode, UnusableSettingsNameThemselvesAndTheRemedy) {
  const std::vector<std::pair<DecodeSettings, std::string>> rows = {
      {{{"speed", "1"}}, "unknown key 'speed': saa_serial accepts bits and address"},
      {{{"bits", "9"}}, "bits=9: expected 10..26"},
      {{{"bits", "27"}}, "bits=27: expected 10..26"},
      {{{"bits", "14bits"}}, "bits=14bits: expected"},
      {{{"address", "255"}}, "address=255: expected"},
      {{{"address", ""}}, "address=: expected"}};
  for (const auto& [settings, text] : rows) {
    const std::string error = ErrorText(Decode(settings, GoldenBytes("FF")));
    EXPECT_NE(error.find(text), std::string::npos) << error;
  }
}

}  // namespace
}  // namespace axlecast::saa_serial
