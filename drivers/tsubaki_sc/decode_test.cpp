// The output of `axlecast decode tsubaki-sc` for a frame: README.md of this folder and docs/decode.md.
#include "drivers/tsubaki_sc/family.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <nlohmann/json.hpp>
#include <sstream>
#include <string>

#include "tests/support/golden_file.h"

namespace axlecast::tsubaki_sc {
namespace {

using Json = nlohmann::ordered_json;
using testing::HasSubstr;

Json Decoded(Bytes frame, const DecodeSettings& settings = {}) { return Decode(settings, frame).value(); }

// "start=300, endian=low"
DecodeSettings SettingsOf(const std::string& text) {
  DecodeSettings settings;
  std::istringstream parts(text);
  for (std::string part; std::getline(parts, part, ',');) {
    const std::size_t first = part.find_first_not_of(' ');
    const std::size_t equals = part.find('=');
    settings.emplace_back(part.substr(first, equals - first), part.substr(equals + 1));
  }
  return settings;
}

TEST(ScDecode, GuidelineFrames) {
  for (const GoldenRow& row : GoldenRows(__FILE__, "frames.txt", 3)) {
    EXPECT_EQ(Decoded(GoldenBytes(row.columns[1]), SettingsOf(row.columns[0])), Json::parse(row.columns[2]))
        << row.where;
  }
}

// Guideline 4: a frame with any one bit inverted is not processed. It is never good; it may be another kind.
TEST(ScDecode, NoFrameWithOneWrongBitIsGood) {
  for (const GoldenRow& row : GoldenRows(__FILE__, "frames.txt", 3)) {
    std::vector<std::uint8_t> frame = GoldenBytes(row.columns[1]);
    if (!Json::parse(row.columns[2])["ok"].get<bool>()) continue;
    for (std::size_t bit = 0; bit < 8 * frame.size(); ++bit) {
      frame[bit / 8] ^= static_cast<std::uint8_t>(1U << (bit % 8));
      EXPECT_FALSE(Decoded(frame)["ok"]) << row.where << " bit " << bit;
      frame[bit / 8] ^= static_cast<std::uint8_t>(1U << (bit % 8));
    }
  }
}

TEST(ScDecode, EveryCutOfAFrameIsBad) {
  for (const GoldenRow& row : GoldenRows(__FILE__, "frames.txt", 3)) {
    const std::vector<std::uint8_t> frame = GoldenBytes(row.columns[1]);
    if (!Json::parse(row.columns[2])["ok"].get<bool>()) continue;
    for (std::size_t size = 0; size < frame.size(); ++size) {
      EXPECT_FALSE(Decoded(Bytes(frame).first(size))["ok"]) << row.where << " cut to " << size;
    }
  }
}

TEST(ScDecode, NoPasswordIsShown) {
  int masked = 0;
  for (const GoldenRow& row : GoldenRows(__FILE__, "frames.txt", 3)) {
    const Json json = Decoded(GoldenBytes(row.columns[1]), SettingsOf(row.columns[0]));
    if (!json.contains("masked")) continue;
    ++masked;
    EXPECT_FALSE(json.contains("registers")) << row.where;
  }
  EXPECT_EQ(masked, 5);
}

TEST(ScDecode, WrongSettingsAreNamed) {
  for (const auto& [settings, text] : std::vector<std::pair<DecodeSettings, std::string>>{
           {{{"start", "65536"}}, "0..65535"},
           {{{"start", "-1"}}, "0..65535"},
           {{{"start", ""}}, "0..65535"},
           {{{"endian", "big"}}, "high or low"},
           {{{"bits", "17"}}, "start, request and endian"},
           {{{"request", ""}}, "whole request"},
           {{{"request", "xx"}}, "whole request"},
           {{{"request", "01 04 00 64 00 07"}}, "right CRC"},
           {{{"request", "01 84 02 C2 C1"}}, "whole request"},  // a reply
           {{{"request", "01 04 01 E3"}}, "whole request"}}) {  // sealed, but no whole read
    EXPECT_THAT(ErrorText(Decode(settings, {})), HasSubstr(text));
  }
  EXPECT_THAT(ErrorText(Decode({{"request", "01 10 00 64 70 61 73 73"}}, {})), Not(HasSubstr("70 61")));
}

TEST(ScDecode, ALaterHintReplacesAnEarlierOne) {
  const auto reply = GoldenBytes("01 04 02 FF 00 F8 C0");
  ASSERT_TRUE(Decoded(reply)["ok"]);
  EXPECT_EQ(Decoded(reply, {{"start", "100"}, {"start", "300"}})["logged_in"], true);
  EXPECT_EQ(Decoded(reply, {{"request", "01 04 00 64 00 07 F0 17"}, {"start", "300"}})["logged_in"], true);
  EXPECT_EQ(Decoded(reply, {{"start", "300"}, {"request", "01 04 00 64 00 01 70 15"}})["voltage_v"], 6528.0);
}

}  // namespace
}  // namespace axlecast::tsubaki_sc
