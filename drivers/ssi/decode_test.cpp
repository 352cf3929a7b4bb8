#include "drivers/ssi/family.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <nlohmann/json.hpp>
#include <sstream>

#include "drivers/saa/table_test_support.h"
#include "drivers/ssi/test_support.h"
#include "tests/support/golden_file.h"

namespace axlecast::ssi {
namespace {

using testing::HasSubstr;

DecodeSettings SettingsOf(const std::string& text) {
  DecodeSettings settings;
  std::istringstream words(text);
  for (std::string word; words >> word;) {
    const std::size_t equals = word.find('=');
    settings.emplace_back(word.substr(0, equals), word.substr(equals + 1));
  }
  return settings;
}

nlohmann::json DecodeBits(const std::string& settings, const std::string& levels) {
  const ClockedBits bits(levels);
  DecodeSettings all = SettingsOf(settings);
  all.emplace_back("bit_count", std::to_string(bits.count));
  return Decode(all, bits.bytes).value();
}

nlohmann::json DecodeHex(const std::string& settings, const std::string& hex) {
  return Decode(SettingsOf(settings), GoldenBytes(hex)).value();
}

TEST(SsiDecode, TheDocumentsWords) {
  for (const GoldenRow& row : GoldenRows(__FILE__, "words.txt", 5)) {
    const nlohmann::json json = DecodeBits(row.columns[0], row.columns[1]);
    ASSERT_EQ(json["ok"], true) << row.where << json.dump();
    EXPECT_EQ(json["kind"], "position_word");
    EXPECT_EQ(json["counts"], std::stoi(row.columns[2])) << row.where;
    EXPECT_EQ(json.contains("turns"), row.columns[3] != "-") << row.where;
    if (json.contains("turns")) {
      EXPECT_EQ(json["turns"], std::stoi(row.columns[3])) << row.where;
    }
    EXPECT_NEAR(json["angle_deg"].get<double>(), std::stod(row.columns[4]), 6e-5) << row.where;
  }
}

// SAA manual 5.5 (4), its formula for 12 bits: "theta = 360 a / 2^14, theta = 360 a / 4096". What it prints as the result,
// 43.5058 (cut off after four digits), follows from 12 bits; 2^14 would be that of an encoder of 14 bits.
TEST(SsiDecode, TheFormulasMisprint) {
  EXPECT_NEAR(DecodeBits("bits=12", "000111101111")["angle_deg"].get<double>(), 43.5058, 6e-5);
  EXPECT_NEAR(DecodeBits("bits=14", "00000111101111")["angle_deg"].get<double>(), 10.8765, 5e-5);
}

// SAA manual 4.1, "Angular Resolution": one count is what each column of the table prints.
TEST(SsiDecode, OneCountIsTheResolutionOfTheTable) {
  for (const saa::TableColumn& column : saa::kTable41) {
    const std::string word = std::string(static_cast<std::size_t>(column.bits) - 1, '0') + "1";
    const nlohmann::json json = DecodeBits("bits=" + std::to_string(column.bits), word);
    ASSERT_EQ(json["counts"], 1) << json;
    EXPECT_TRUE(saa::IsPrintedResolution(column, json["angle_deg"].get<double>() * 3'600)) << json;
  }
}

// SAA manual 5.5: "12 bits SSI encoder sends 14 bits clock reads the data, the maximum angle values of thousands of
// degrees ... the extra clock will read out repeat the high-order data". 14 bits scaled as 12.
TEST(SsiDecode, TooManyClocksForTheBits) {
  const nlohmann::json wrong = DecodeBits("bits=14", "111111111110 11");
  EXPECT_EQ(wrong["counts"], 16'379);
  EXPECT_GT(wrong["counts"].get<double>() * 360 / 4096, 1'000);
  // If the setting is right, the extra clocks are checked.
  EXPECT_EQ(DecodeBits("bits=12 trailing=repeat repeat=none", "1 111111111110 0 1")["counts"], 4094);
}

TEST(SsiDecode, BytesAsTheyWereClockedIn) {
  EXPECT_EQ(DecodeHex("bits=12", "8F 78")["counts"], 495);               // 1 000111101111 000
  EXPECT_EQ(DecodeHex("bits=12 bit_count=13", "8F 78")["counts"], 495);  // the last three bits do not count
  EXPECT_EQ(DecodeHex("bits=12", "0F 78")["error"], "line_low");
  EXPECT_EQ(DecodeHex("bits=12", "FF FF")["error"], "all_ones");
  EXPECT_EQ(DecodeHex("bits=12 all_ones=position", "FF FF")["counts"], 4095);
  EXPECT_EQ(DecodeHex("bits=12", "8F")["error"], "short");
  EXPECT_EQ(DecodeHex("bits=12", "")["error"], "short");
  EXPECT_EQ(DecodeHex("bits=12 bit_count=99", "8F 78")["error"], "short");
  EXPECT_EQ(DecodeHex("bits=12 trailing=zero", "8F 79")["error"], "trailing");
  EXPECT_EQ(DecodeHex("bits=10 turn_bits=8 format=tree25 gray=true trailing=zero", "C0 00 00 00")["error"],
            "range");
}

TEST(SsiDecode, RepeatedWords) {
  const std::string settings = "bits=12 repeat=one_zero";
  EXPECT_EQ(DecodeBits(settings, "1 000111101111 0 000111101111")["counts"], 495);
  EXPECT_EQ(DecodeBits(settings, "1 000111101111 0 000111101110")["error"], "repeat");
  EXPECT_EQ(DecodeBits(settings, "1 000111101111 1 000111101111")["error"], "repeat");
  EXPECT_EQ(DecodeBits("bits=12 repeat=no_gap words=3", "1 000111101111 000111101111 000111101111")["counts"], 495);
}

TEST(SsiDecode, StatusAndParityBits) {
  const std::string settings = "bits=12 status=alarm:13 status=power_fail:14:low parity=even:15";
  nlohmann::json json = DecodeBits(settings, "000111101111 0 1 1");
  EXPECT_EQ(json["counts"], 495);
  EXPECT_EQ(json["alarms"], nlohmann::json::array());
  json = DecodeBits(settings, "000111101111 1 0 1");
  EXPECT_EQ(json["alarms"], (nlohmann::json{"alarm", "power_fail"}));
  EXPECT_EQ(DecodeBits(settings, "000111101111 1 0 0")["error"], "checksum");
  // A status bit in front of the position.
  json = DecodeBits("bits=12 first_bit=2 status=ready:1", "1 000111101111");
  EXPECT_EQ(json["counts"], 495);
  EXPECT_EQ(json["alarms"], (nlohmann::json{"ready"}));
}

TEST(SsiDecode, WithoutBitsTheWordIsWhatWasGiven) {
  EXPECT_EQ(DecodeBits("", "000111101111")["counts"], 495);
  EXPECT_EQ(DecodeBits("turn_bits=2", "01 0111101111")["turns"], 1);
}

TEST(SsiDecode, WrongSettings) {
  const std::vector<std::pair<std::string, std::string>> rows = {
      {"", "bits=: expected 1..32"},
      {"bits=0", "bits=0: expected 1..32"},
      {"bits=33", "bits=33: expected 1..32"},
      {"bits=12 gray=maybe", "gray=maybe: expected false or true"},
      {"bits=12 format=tree", "format=tree: expected plain or tree25"},
      {"bits=14 format=tree25", "turn_bits up to 12 and bits up to 13"},
      {"bits=30 turn_bits=12", "at most 32 together"},
      {"bits=12 word_bits=11", "word_bits=11: expected at least 12"},
      {"bits=32 first_bit=48", "expected at most 48"},
      {"bits=12 parity=even", "parity=even: expected even:BIT"},
      {"bits=12 parity=none:3", "parity=none:3: expected even:BIT"},
      {"bits=12 status=alarm", "status=alarm: expected NAME:BIT"},
      {"bits=12 status=alarm:99", "expected NAME:BIT"},
      {"bits=12 status=:13", "expected NAME:BIT"},
      {"bits=12 status=a:13:up", "expected NAME:BIT"},
      {"bits=12 repeat=two", "repeat=two: expected none or one_zero or no_gap"},
      {"bits=12 repeat=one_zero trailing=zero", "trailing=zero: expected repeat"},
      {"bits=12 words=1", "words=1: expected 2..4"},
      {"bits=12 bit_count=-1", "bit_count=-1: expected 0.."},
      {"bits=12 baud=9600", "unknown key 'baud': ssi accepts bits"}};
  for (const auto& [text, problem] : rows) {
    EXPECT_THAT(ErrorText(Decode(SettingsOf(text), {})), HasSubstr(problem)) << text;
  }
}

}  // namespace
}  // namespace axlecast::ssi
