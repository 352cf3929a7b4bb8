// The output of `axlecast decode tformat`: docs/decode.md.
#include "drivers/tformat/family.h"

#include <gtest/gtest.h>

#include <nlohmann/json.hpp>
#include <string>

#include "tests/support/golden_file.h"

namespace axlecast::tformat {
namespace {

using Json = nlohmann::ordered_json;

Json Decoded(const std::string& hex, const DecodeSettings& settings = {}) {
  return Decode(settings, GoldenBytes(hex)).value();
}

// The stated results of the public captures, word by word.
TEST(TFormatDecode, Captures) {
  const DecodeSettings bits23 = {{"bits", "23"}};
  EXPECT_EQ(Decoded("02 20 6E C3 58 D7", bits23),
            Json::parse(R"({"ok":true,"kind":"read_single_turn_reply","id":"0",
      "counts":5817198,"angle_deg":249.6470546722412,"alarms":["multi_turn_or_battery"],"status":"0x20"})"));
  EXPECT_EQ(Decoded("02 20 D6 43 1A AD", bits23)["counts"], 1721302);
  EXPECT_EQ(Decoded("02 20 B4 BD 1C 37", bits23)["counts"], 1883572);
  EXPECT_EQ(Decoded("02 20 50 A9 78 A3", bits23)["counts"], 7907664);
  EXPECT_EQ(Decoded("1A 00 A5 A5 00 17 88 88 00 00 0D"), Json::parse(R"({"ok":true,"kind":"read_all_reply","id":"3",
      "counts":42405,"turns":34952,"angle_deg":116.46881103515625,"alarms":[],"status":"0x00","encoder_id":"0x17"})"));
  // At 17 bits the always-zero bits refuse them.
  EXPECT_EQ(Decoded("02 20 6E C3 58 D7"),
            Json::parse(R"({"ok":false,"kind":"read_single_turn_reply","error":"range"})"));
}

// Every reply of the golden files by its error word. A frame alone has no request, so those rows are left out whose
// reply is good for another request, and those whose control field cannot be that of the request.
TEST(TFormatDecode, SpecRepliesHaveTheirErrorWord) {
  for (const GoldenRow& row : GoldenRows(__FILE__, "spec_replies.txt", 4)) {
    const std::string& request = row.columns[0];
    const std::string& reply = row.columns[1];
    if (request.substr(0, 2) != reply.substr(0, 2) || row.columns[3] == "error=wrong_echo") continue;
    if (reply == "EA 00 EA") continue;  // a reply cut short that is a good request
    const Json json = Decoded(reply, {{"bits", row.columns[2]}});
    const bool bad = row.columns[3].starts_with("error=");
    EXPECT_EQ(json["ok"], !bad) << row.where;
    ASSERT_EQ(json.contains("error"), bad) << row.where;
    if (!bad) continue;
    EXPECT_EQ(json["error"], row.columns[3].substr(6, row.columns[3].find(' ') - 6)) << row.where;
  }
}

TEST(TFormatDecode, Requests) {
  const std::vector<std::pair<std::string, std::string>> kinds = {
      {"02", "read_single_turn_request"},      {"8A", "read_multi_turn_request"},
      {"92", "read_encoder_id_request"},       {"1A", "read_all_request"},
      {"BA", "clear_errors_request"},          {"C2", "zero_single_turn_request"},
      {"62", "reset_turns_and_errors_request"}};
  for (const auto& [hex, kind] : kinds) {
    const Json json = Decoded(hex);
    EXPECT_EQ(json["ok"], true);
    EXPECT_EQ(json["kind"], kind);
    EXPECT_EQ(json.size(), 3U) << json;  // and id
  }
  EXPECT_EQ(Decoded("EA 00 EA"), Json::parse(R"({"ok":true,"kind":"eeprom_read_request","id":"D","address":0})"));
  // The reply that accepts a write is the same bytes.
  EXPECT_EQ(Decoded("32 00 55 67"), Json::parse(R"({"ok":true,"kind":"eeprom_write_request_or_reply","id":"6",
      "address":0,"data":"0x55"})"));
}

TEST(TFormatDecode, EepromReplies) {
  EXPECT_EQ(Decoded("EA 00 55 BF"), Json::parse(R"({"ok":true,"kind":"eeprom_read_reply","id":"D","address":0,
      "busy":false,"data":"0x55"})"));
  EXPECT_EQ(Decoded("EA 80 00 6A"), Json::parse(R"({"ok":true,"kind":"eeprom_read_reply","id":"D","address":0,
      "busy":true})"));
  EXPECT_EQ(Decoded("32 80 00 B2"), Json::parse(R"({"ok":true,"kind":"eeprom_write_reply","id":"6","address":0,
      "busy":true})"));
}

TEST(TFormatDecode, DamagedEepromFrames) {
  const std::vector<std::array<std::string, 3>> rows = {
      {"EA", "eeprom_read_request", "short"},
      {"EA 00", "eeprom_read_request", "short"},
      {"EA 00 EB", "eeprom_read_request", "checksum"},
      {"EA 50 BA", "eeprom_read_request", "range"},   // address 80
      {"EA 80 6A", "eeprom_read_request", "range"},   // busy in a request
      {"EA 50 00 BA", "eeprom_read_reply", "range"},  // address 80
      {"EA 00 55 BE", "eeprom_read_reply", "checksum"},
      {"EA 80 55 3F", "eeprom_read_reply", "range"},  // busy with data
      {"EA 00 55 BF 00", "eeprom_read_reply", "long"},
      {"32 00 55", "eeprom_write_request_or_reply", "short"},
      {"32 00 55 66", "eeprom_write_request_or_reply", "checksum"},
      {"32 50 00 62", "eeprom_write_request_or_reply", "range"},
      {"32 80 55 E7", "eeprom_write_reply", "range"}};
  for (const auto& [hex, kind, error] : rows) {
    EXPECT_EQ(Decoded(hex), Json({{"ok", false}, {"kind", kind}, {"error", error}})) << hex;
  }
}

// Spec 6.3.3, Table 3, and 6.3.2 (3). A device-reported error is no error of the frame.
TEST(TFormatDecode, AlarmsOfAlmcAndStatus) {
  const std::vector<std::pair<std::string, std::string>> rows = {
      {"1A 00 00 00 00 11 00 00 00 01 0A", R"(["over_speed"])"},
      {"1A 00 00 00 00 11 00 00 00 02 09", R"(["full_absolute_status"])"},
      {"1A 10 00 00 00 11 00 00 00 04 1F", R"(["counting_error"])"},
      {"1A 00 00 00 00 11 00 00 00 08 03", R"(["counter_overflow"])"},
      {"1A 20 00 00 00 11 00 00 00 20 0B", R"(["multi_turn_error"])"},
      {"1A 20 00 00 00 11 00 00 00 40 6B", R"(["battery_error"])"},
      {"1A 20 00 00 00 11 00 00 00 80 AB", R"(["battery_alarm"])"},
      {"1A 20 00 00 00 11 00 00 00 C8 E3", R"(["counter_overflow","battery_error","battery_alarm"])"},
      {"02 10 00 00 00 12", R"(["counting_error"])"},
      {"02 30 00 00 00 32", R"(["counting_error","multi_turn_or_battery"])"},
      {"92 00 11 83", "[]"}};
  for (const auto& [hex, alarms] : rows) {
    const Json json = Decoded(hex);
    EXPECT_EQ(json["ok"], true) << json;
    EXPECT_EQ(json["alarms"], Json::parse(alarms)) << hex;
  }
}

// A communication alarm and the answer to an abnormal request hold alarms, never a reading.
TEST(TFormatDecode, AnswersToAbnormalRequests) {
  EXPECT_EQ(Decoded("1A 40 12 34 01 11 78 56 00 00 42"), Json::parse(R"({"ok":false,"kind":"read_all_reply",
      "error":"communication_alarm","alarms":["request_parity_error"],"status":"0x40","encoder_id":"0x11"})"));
  EXPECT_EQ(Decoded("02 80 12 34 01 11 78 56 00 00 9A"), Json::parse(R"({"ok":false,"kind":"abnormal_request_reply",
      "error":"communication_alarm","alarms":["request_delimiter_error"],"status":"0x80","encoder_id":"0x11"})"));
  EXPECT_EQ(Decoded("62 00 12 34 01 11 78 56 00 00 7A"), Json::parse(R"({"ok":false,"kind":"abnormal_request_reply",
      "error":"abnormal_reply","alarms":[],"status":"0x00","encoder_id":"0x11"})"));
  EXPECT_EQ(Decoded("03 00 12 34 01 11 78 56 00 00 1B")["error"], "abnormal_reply");
  EXPECT_EQ(Decoded("EA 20 12 34 01 11 78 56 00 40 92"), Json::parse(R"({"ok":false,"kind":"abnormal_request_reply",
      "error":"abnormal_reply","alarms":["battery_error"],"status":"0x20","encoder_id":"0x11"})"));
  EXPECT_EQ(Decoded("02 40 12 34 01 65"), Json::parse(R"({"ok":false,"kind":"read_single_turn_reply",
      "error":"communication_alarm","alarms":["request_parity_error"],"status":"0x40"})"));
}

TEST(TFormatDecode, FramesThatAreNone) {
  for (const char* hex : {"00", "FF", "9A", "A2", "03 00 12 34 01 25", "FF FF FF FF FF FF FF FF FF FF FF"}) {
    EXPECT_EQ(Decoded(hex), Json::parse(R"({"ok":false,"kind":"unknown","error":"control_field"})")) << hex;
  }
  EXPECT_EQ(Decoded(""), Json::parse(R"({"ok":false,"kind":"unknown","error":"short"})"));
  EXPECT_EQ(Decoded("1A 00")["error"], "short");
  EXPECT_EQ(Decoded("02 00 12 34 01 24")["error"], "checksum");
  EXPECT_EQ(Decoded("02 00 12 34 01 25 25")["error"], "long");
}

TEST(TFormatDecode, SettingsDecideWhatIsRight) {
  const std::string capture = "1A 00 A5 A5 00 17 88 88 00 00 0D";
  EXPECT_EQ(Decoded(capture, {{"enid", "0x17"}})["ok"], true);
  EXPECT_EQ(Decoded(capture, {{"enid", "23"}})["ok"], true);
  EXPECT_EQ(Decoded(capture, {{"enid", "17"}}), Json::parse(R"({"ok":false,"kind":"read_all_reply",
      "error":"wrong_identity","alarms":[],"status":"0x00","encoder_id":"0x17"})"));
  EXPECT_EQ(Decoded("92 00 11 83", {{"enid", "0x17"}})["error"], "wrong_identity");
  EXPECT_EQ(Decoded(capture, {{"bits", "15"}})["error"], "range");
  EXPECT_EQ(Decoded(capture, {{"bits", "16"}})["angle_deg"], 2 * 116.46881103515625);
  EXPECT_EQ(Decoded(capture, {{"turn_bits", "15"}})["error"], "range");
  EXPECT_FALSE(Decoded("1A 00 A5 A5 00 11 00 00 00 00 0B", {{"turn_bits", "0"}}).contains("turns"));
  EXPECT_EQ(Decoded(capture, {{"model", "ts5669n127"}})["error"], "wrong_identity");
  EXPECT_EQ(Decoded(capture, {{"model", "ts5669n127"}, {"enid", "0x17"}})["ok"], true);
}

TEST(TFormatDecode, UnusableSettingsNameThemselvesAndTheRemedy) {
  const std::vector<std::pair<DecodeSettings, std::string>> rows = {
      {{{"speed", "1"}}, "unknown key 'speed': tformat accepts model, bits, turn_bits and enid"},
      {{{"bits", "0"}}, "bits=0: expected 1..24"},
      {{{"bits", "25"}}, "bits=25: expected 1..24"},
      {{{"bits", "17bits"}}, "bits=17bits: expected"},
      {{{"bits", ""}}, "bits=: expected"},
      {{{"turn_bits", "-1"}}, "turn_bits=-1: expected 0..24"},
      {{{"enid", "256"}}, "enid=256: expected 0..255"},
      {{{"enid", "0x"}}, "enid=0x: expected"},
      {{{"enid", "99999999999999999999"}}, "expected 0..255"},
      {{{"model", "x"}}, "model=x: expected one of ts5669n127"}};
  for (const auto& [settings, text] : rows) {
    const std::string error = ErrorText(Decode(settings, GoldenBytes("1A")));
    EXPECT_NE(error.find(text), std::string::npos) << error;
  }
}

}  // namespace
}  // namespace axlecast::tformat
