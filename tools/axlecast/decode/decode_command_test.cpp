#include "tools/axlecast/decode/decode_command.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <nlohmann/json.hpp>
#include <sstream>

namespace axlecast {
namespace {

using testing::HasSubstr;
using testing::IsEmpty;

constexpr const char* kCapture = "1A 00 A5 A5 00 17 88 88 00 00 0D";  // drivers/tformat/golden/captures.txt

struct Output {
  int exit_code = -1;
  std::vector<nlohmann::json> objects;
  std::string err;
};

Output DecodeWith(const DecodeArguments& arguments, const std::string& input = "") {
  std::istringstream in(input);
  std::ostringstream out;
  std::ostringstream err;
  Output result;
  result.exit_code = RunDecode(arguments, in, out, err);
  result.err = err.str();
  std::istringstream lines(out.str());
  for (std::string line; std::getline(lines, line);) result.objects.push_back(nlohmann::json::parse(line));
  return result;
}

TEST(DecodeCommand, OneObjectPerArgument) {
  const Output result = DecodeWith({"tformat", {"enid=0x17"}, {kCapture, "EA00EA"}});
  EXPECT_EQ(result.exit_code, 0);
  ASSERT_EQ(result.objects.size(), 2U);
  EXPECT_EQ(result.objects[0]["counts"], 42405);
  EXPECT_EQ(result.objects[0]["turns"], 34952);
  EXPECT_EQ(result.objects[1]["kind"], "eeprom_read_request");
  EXPECT_THAT(result.err, IsEmpty());
}

TEST(DecodeCommand, OneObjectPerLineOfInput) {
  const std::string input =
      std::string("# a capture\n\n  \t\r\n") + kCapture + " # good\r\n02\n\n0x1A,0x00\nEA 00 EA";
  const Output result = DecodeWith({"tformat", {}, {}}, input);
  EXPECT_EQ(result.exit_code, 1);
  ASSERT_EQ(result.objects.size(), 4U);
  EXPECT_EQ(result.objects[0]["ok"], true);
  EXPECT_EQ(result.objects[1]["kind"], "read_single_turn_request");
  EXPECT_EQ(result.objects[2]["error"], "short");
  EXPECT_THAT(result.objects[2]["detail"], ::testing::HasSubstr(" received, at least "));
  EXPECT_EQ(result.objects[3]["address"], 0);  // the last line has no end
}

TEST(DecodeCommand, ArgumentsLeaveTheInputAlone) {
  EXPECT_EQ(DecodeWith({"tformat", {}, {"02"}}, "garbage\n").objects.size(), 1U);
}

TEST(DecodeCommand, TextThatIsNoHexIsABadFrame) {
  const Output result = DecodeWith({"tformat", {}, {"1A zz", "02", ""}});
  EXPECT_EQ(result.exit_code, 1);
  ASSERT_EQ(result.objects.size(), 3U);
  EXPECT_EQ(result.objects[0]["ok"], false);
  EXPECT_EQ(result.objects[0]["error"], "not_hex");
  EXPECT_THAT(result.objects[0]["detail"].get<std::string>(), HasSubstr("column 4"));
  EXPECT_EQ(result.objects[1]["ok"], true);
  EXPECT_EQ(result.objects[2]["error"], "short");  // an empty argument is a frame without bytes, not nothing
}

TEST(DecodeCommand, AProblemOfTheInputNamesItsLine) {
  const Output result = DecodeWith({"tformat", {}, {}}, "02\n\n  # comment\n02 0\n");
  ASSERT_EQ(result.objects.size(), 2U);
  EXPECT_THAT(result.objects[1]["detail"].get<std::string>(), HasSubstr("line 4, column 4: '0' is alone"));
}

TEST(DecodeCommand, BinaryAndEndlessInputIsSurvived) {
  std::string binary;
  for (int i = 0; i < 100'000; ++i) binary += static_cast<char>(i * 7 % 256);
  EXPECT_EQ(DecodeWith({"tformat", {}, {}}, binary).exit_code, 1);
  const Output result = DecodeWith({"tformat", {}, {}}, std::string(10'000'000, 'A') + "\n02\n");
  EXPECT_EQ(result.exit_code, 1);
  ASSERT_EQ(result.objects.size(), 2U);
  EXPECT_EQ(result.objects[0]["error"], "long");
  EXPECT_EQ(result.objects[1]["ok"], true);
}

// `axlecast decode tformat < endless | head -1` must end.
TEST(DecodeCommand, OutputThatCannotBeWrittenEndsIt) {
  std::istringstream in("02\n02\n02\n");
  std::ostringstream out;
  out.setstate(std::ios::badbit);
  std::ostringstream err;
  EXPECT_EQ(RunDecode({"tformat", {}, {}}, in, out, err), 4);
  EXPECT_THAT(err.str(), HasSubstr("could not be written"));
  std::string left;
  EXPECT_TRUE(std::getline(in, left));
}

TEST(DecodeCommand, NoInputSaysSo) {
  const Output result = DecodeWith({"tformat", {}, {}}, "# only a comment\n");
  EXPECT_EQ(result.exit_code, 0);
  EXPECT_THAT(result.objects, IsEmpty());
  EXPECT_THAT(result.err, HasSubstr("no frames"));
}

TEST(DecodeCommand, WrongUsage) {
  const std::vector<std::pair<DecodeArguments, std::string>> rows = {
      {{"canopen", {}, {"02"}}, "unknown protocol 'canopen'; known: "},
      {{"tformat", {"bits"}, {"02"}}, "--set 'bits': expected key=value"},
      {{"tformat", {"=1"}, {"02"}}, "expected key=value"},
      {{"tformat", {"baud=9600"}, {"02"}}, "unknown key 'baud'"},
      {{"tformat", {"bits=99"}, {"02"}}, "bits=99: expected 1..24"}};
  for (const auto& [arguments, text] : rows) {
    const Output result = DecodeWith(arguments);
    EXPECT_EQ(result.exit_code, 2) << text;
    EXPECT_THAT(result.objects, IsEmpty());
    EXPECT_THAT(result.err, HasSubstr(text));
  }
  EXPECT_THAT(DecodeWith({"canopen", {}, {}}).err, HasSubstr("tformat"));
}

TEST(DecodeCommand, UnquotedBytesGetAHint) {
  EXPECT_THAT(DecodeWith({"tformat", {}, {"1A", "00", "A5"}}).err, HasSubstr("between quotes"));
  EXPECT_THAT(DecodeWith({"tformat", {}, {"1A", "02"}}).err, IsEmpty());  // two good requests
}

// SAA manual 5.5 (4), Gray code, and a word that is not all there.
TEST(DecodeCommand, BitsInTheOrderInWhichTheyWereClockedIn) {
  DecodeArguments arguments{"ssi", {"bits=12"}, {"000111101111", "0001 1110 1111 # SAA", "1000_11"}};
  arguments.bits = true;
  const Output result = DecodeWith(arguments);
  EXPECT_EQ(result.exit_code, 1);
  ASSERT_EQ(result.objects.size(), 3U);
  EXPECT_EQ(result.objects[0]["counts"], 495);
  EXPECT_EQ(result.objects[1]["counts"], 495);
  EXPECT_EQ(result.objects[2]["error"], "short");
  arguments.frames = {};
  const Output lines = DecodeWith(arguments, "000111101111\n\n# comment\n8F 78\n1\n");
  ASSERT_EQ(lines.objects.size(), 3U);
  EXPECT_EQ(lines.objects[0]["ok"], true);
  EXPECT_EQ(lines.objects[1]["error"], "not_bits");
  EXPECT_THAT(lines.objects[1]["detail"].get<std::string>(), HasSubstr("line 4, column 1: '8'"));
}

TEST(DecodeCommand, BitsOfOtherLinesAreWrongUsage) {
  DecodeArguments arguments{"tformat", {}, {"0010"}};
  arguments.bits = true;
  const Output result = DecodeWith(arguments);
  EXPECT_EQ(result.exit_code, 2);
  EXPECT_THAT(result.err, HasSubstr("ssi"));
  arguments = {"ssi", {"bits=99"}, {"0010"}};
  arguments.bits = true;
  EXPECT_EQ(DecodeWith(arguments).exit_code, 2);
  arguments = {"ssi", {"bits=12"}, {"0001", "1110", "1111"}};
  arguments.bits = true;
  EXPECT_THAT(DecodeWith(arguments).err, HasSubstr("between quotes"));
}

// SAA manual 5.4.1 (5) as can-utils write it, and as a packet in hex.
TEST(DecodeCommand, CanFramesAsCandumpPrintsThem) {
  const Output result = DecodeWith({"saa-can", {}, {"120#4726000000000000", "00 00 01 20 47 26", "120#4"}});
  EXPECT_EQ(result.exit_code, 1);
  ASSERT_EQ(result.objects.size(), 3U);
  EXPECT_EQ(result.objects[0]["counts"], 9799);
  EXPECT_EQ(result.objects[1], result.objects[0]);
  EXPECT_EQ(result.objects[2]["error"], "not_hex");
  const Output lines = DecodeWith({"saa-can", {}, {}}, "# candump can0\n  can0  120   [2]  47 26\n");
  ASSERT_EQ(lines.objects.size(), 1U);
  EXPECT_EQ(lines.objects[0]["counts"], 9799);
}

// The grammar of the command line: --set takes one value, so that frames may follow it.
TEST(DecodeCommand, CommandLine) {
  CLI::App app;
  int exit_code = -1;
  AddDecodeCommand(app, exit_code);
  testing::internal::CaptureStdout();
  app.parse("decode tformat --set bits=23 --set turn_bits=16 \"02 20 6E C3 58 D7\" 02");
  const std::string out = testing::internal::GetCapturedStdout();
  EXPECT_EQ(exit_code, 0);
  EXPECT_THAT(out, HasSubstr("\"counts\":5817198,"));
  EXPECT_EQ(std::count(out.begin(), out.end(), '\n'), 2);
  testing::internal::CaptureStdout();
  app.parse("decode ssi --set bits=12 --bits 000111101111");
  EXPECT_THAT(testing::internal::GetCapturedStdout(), HasSubstr("\"counts\":495,"));
  EXPECT_THROW(app.parse("decode"), CLI::RequiredError);
}

}  // namespace
}  // namespace axlecast
