#include "drivers/saa_can/family.h"

#include <gtest/gtest.h>

#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "drivers/saa/table_test_support.h"
#include "tests/support/golden_file.h"

namespace axlecast::saa_can {
namespace {

std::string Decoded(std::uint32_t id, const std::vector<std::uint8_t>& data, const DecodeSettings& settings = {}) {
  return Decode(settings, ToPacket({.id = id, .data = InlineBytes<kMaxCanData>(data)})).value().dump();
}

TEST(SaaCanDecode, PositionsOfTheManual) {
  for (const GoldenRow& row : GoldenRows(__FILE__, "positions.txt", 5)) {
    const auto id = static_cast<std::uint32_t>(std::stoul(row.columns[0], nullptr, 16));
    const CanPacket packet = ToPacket({.id = id, .data = InlineBytes<kMaxCanData>(GoldenBytes(row.columns[1]))});
    const auto json = Decode({}, packet).value();
    EXPECT_EQ(json["kind"], "position") << row.where;
    EXPECT_EQ(json["node"], id & 0xFFU) << row.where;
    EXPECT_EQ(json["counts"], std::stoi(row.columns[3])) << row.where;
    EXPECT_NEAR(json["angle_deg"].get<double>(), std::stod(row.columns[4]), 5e-5) << row.where;
  }
}

// 4.1, "Angular Resolution": one count is what each column of the table prints.
TEST(SaaCanDecode, OneCountIsTheResolutionOfTheTable) {
  for (const saa::TableColumn& column : saa::kTable41) {
    const auto json =
        nlohmann::json::parse(Decoded(0x120, {1, 0, 0, 0, 0, 0, 0, 0}, {{"bits", std::to_string(column.bits)}}));
    ASSERT_EQ(json.at("counts"), 1) << json;
    EXPECT_TRUE(saa::IsPrintedResolution(column, json.at("angle_deg").get<double>() * 3'600)) << json;
  }
}

TEST(SaaCanDecode, EveryPrintedFrame) {
  for (const GoldenRow& row : GoldenRows(__FILE__, "dialogues.txt", 5)) {
    const auto id = static_cast<std::uint32_t>(std::stoul(row.columns[2], nullptr, 16));
    const std::string text = Decoded(id, GoldenBytes(row.columns[3]));
    EXPECT_NE(text.find("\"ok\":true"), std::string::npos) << row.where << ' ' << text;
    EXPECT_EQ(text.find("counts"), std::string::npos) << row.where << ' ' << text;
  }
}

TEST(SaaCanDecode, WhatTheFramesAre) {
  EXPECT_EQ(Decoded(0x220, {0x31, 0x20, 0x32}),
            R"({"ok":true,"kind":"set_period_request","node":32,"per_second":50})");
  EXPECT_EQ(Decoded(0x220, {0x22, 0x20, 0x01}),
            R"({"ok":true,"kind":"set_direction_request","node":32,"parameter":"0x01"})");
  EXPECT_EQ(Decoded(0x7E5, {0x04, 0x00}), R"({"ok":true,"kind":"leave_configuration_request"})");
  EXPECT_EQ(Decoded(0x7E5, {0x11, 0x20}), R"({"ok":true,"kind":"set_node_id_request_or_refusal","new_node":32})");
  EXPECT_EQ(Decoded(0x7E5, {0x13, 0x00, 0x03}), R"({"ok":true,"kind":"set_bitrate_request","bitrate":250000})");
  EXPECT_EQ(Decoded(0x7E5, {0x13, 0x00, 0x00}),
            R"({"ok":true,"kind":"set_bitrate_request_or_reply","bitrate":1000000})");
  EXPECT_EQ(Decoded(0x7E4, {0x13, 0x00, 0x00}), R"({"ok":true,"kind":"set_bitrate_reply","result":0})");
}

// A frame alone does not show whether it is a position or a reply.
TEST(SaaCanDecode, PositionOrReply) {
  EXPECT_EQ(Decoded(0x120, {0x22, 0x00}), R"({"ok":true,"kind":"position_or_set_direction_reply","node":32})");
  EXPECT_EQ(Decoded(0x120, {0x22, 0x00}, {{"data", "reply"}}),
            R"({"ok":true,"kind":"set_direction_reply","node":32})");
  EXPECT_EQ(Decoded(0x120, {0x22, 0x00}, {{"data", "position"}}),
            R"({"ok":true,"kind":"position","node":32,"counts":34,"angle_deg":0.7470703125})");
  EXPECT_EQ(Decoded(0x120, {0x22, 0x00, 0x01}, {{"bits", "18"}}),
            R"({"ok":true,"kind":"position","node":32,"counts":65570,"angle_deg":90.04669189453125})");
}

TEST(SaaCanDecode, WhatIsWrong) {
  EXPECT_EQ(Decoded(0x120, {0x22}), R"({"ok":false,"kind":"position","error":"short"})");
  EXPECT_EQ(Decoded(0x120, {0x00, 0x40}), R"({"ok":false,"kind":"position","error":"range"})");
  EXPECT_EQ(Decoded(0x121, {0x00, 0x01}, {{"node", "0x20"}}),
            R"({"ok":false,"kind":"position","error":"wrong_identity"})");
  EXPECT_EQ(Decoded(0x220, {0x20, 0x21}), R"({"ok":false,"kind":"zero_request","error":"wrong_identity"})");
  EXPECT_EQ(Decoded(0x220, {0x55, 0x20}), R"({"ok":false,"kind":"request","error":"function"})");
  EXPECT_EQ(Decoded(0x7E5, {0x13, 0x00, 0x01}), R"({"ok":false,"kind":"set_bitrate_request","error":"range"})");
  EXPECT_EQ(Decoded(0x080, {}), R"({"ok":false,"kind":"unknown","error":"header"})");
  EXPECT_EQ(Decoded(0x120 | kCanExtended, {0x47, 0x26}), R"({"ok":false,"kind":"unknown","error":"header"})");
  EXPECT_EQ(Decode({}, std::vector<std::uint8_t>{0x01, 0x20}).value()["error"], "short");
  EXPECT_EQ(Decode({}, std::vector<std::uint8_t>(13)).value()["error"], "long");
}

TEST(SaaCanDecode, SettingsAreChecked) {
  for (const auto& [key, value] : DecodeSettings{
           {"bits", "9"}, {"node", "0"}, {"byte_order", "middle"}, {"data", "x"}, {"model", "y"}, {"zero", "1"}}) {
    EXPECT_NE(ErrorText(Decode({{key, value}}, std::vector<std::uint8_t>(6))), "") << key;
  }
}

TEST(SaaCanDecode, ModelCia406IsAStandardEncoder) {
  EXPECT_NE(Decoded(0x185, {0x01, 0x02, 0, 0}, {{"model", "cia406"}, {"bits", "13"}}).find("\"counts\":513"),
            std::string::npos);
}

}  // namespace
}  // namespace axlecast::saa_can
