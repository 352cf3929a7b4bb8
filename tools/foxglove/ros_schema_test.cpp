#include "tools/foxglove/ros_schema.h"

#include <gtest/gtest.h>

#include <cstdint>
#include <string>
#include <vector>

#include "core/base/text.h"

namespace axlecast {
namespace {

// Returns the bytes of hex digits; spaces separate them.
std::vector<std::uint8_t> FromHex(const std::string& text) {
  std::string digits;
  for (const char character : text) {
    if (character != ' ') digits += character;
  }
  std::vector<std::uint8_t> bytes;
  for (std::size_t i = 0; i + 1 < digits.size(); i += 2)
    bytes.push_back(static_cast<std::uint8_t>(std::stoi(digits.substr(i, 2), nullptr, 16)));
  return bytes;
}

std::string ToHex(const std::string& bytes) {
  return HexDigits({reinterpret_cast<const std::uint8_t*>(bytes.data()), bytes.size()});
}

class RosSchemaTest : public ::testing::Test {
 protected:
  const LcmStruct& Define(const std::string& text, const std::string& name) {
    EXPECT_TRUE(definitions_.Add(text));
    EXPECT_TRUE(definitions_.Finish().empty());
    return *definitions_.Find(name);
  }
  // Returns the fields in CDR as hex digits, without the head; "refused".
  [[nodiscard]] static std::string Cdr(const RosSchema& schema, const std::string& fields) {
    std::vector<std::uint8_t> message(8);
    const std::vector<std::uint8_t> rest = FromHex(fields);
    message.insert(message.end(), rest.begin(), rest.end());
    std::string cdr;
    if (!schema.Transcode(message, cdr)) return "refused";
    EXPECT_EQ(cdr.substr(0, 4), std::string("\0\1\0\0", 4));
    return ToHex(cdr.substr(4));
  }

  LcmDefinitions definitions_;
};

TEST_F(RosSchemaTest, DescribesEveryKindOfField) {
  const RosSchema schema(definitions_, Define(R"(package a.b;
struct point_t { float x; }
struct big_shape_t { const int8_t A = 1; int8_t n; point_t p[n][2]; point_t q[3]; boolean b; byte r[2][2]; string s; double d; })",
                                              "a.b.big_shape_t"));
  EXPECT_EQ(schema.name(), "a_b/msg/BigShape");
  EXPECT_EQ(schema.text(),
            "int8 n\na_b/msg/Point[] p\na_b/msg/Point[3] q\nbool b\nuint8[4] r\nstring s\nfloat64 d\nint8 A=1\n" +
                std::string(80, '=') + "\nMSG: a_b/msg/Point\nfloat32 x\n");
}

TEST_F(RosSchemaTest, AlignsValuesFromBehindTheHead) {
  const RosSchema schema(definitions_,
                         Define("struct a_t { int8_t a; int16_t b; int8_t c; int64_t d; int32_t e; }", "a_t"));
  EXPECT_EQ(Cdr(schema, "01 0203 04 05060708090a0b0c 0d0e0f10"),
            "01000302"
            "04000000"
            "0c0b0a0908070605"
            "100f0e0d");
}

TEST_F(RosSchemaTest, WritesListsAndTexts) {
  const RosSchema schema(
      definitions_,
      Define("struct b_t { int8_t x; } struct a_t { int8_t n; int16_t l[n]; b_t b[2]; string s; byte r[n][2]; }",
             "a_t"));
  EXPECT_EQ(Cdr(schema, "02 0001 0002 05 06 00000003 6869 00 0a0b 0c0d"),
            "02000000"
            "02000000"
            "01000200"
            "0506"
            "0000"
            "03000000"
            "686900"
            "00"
            "04000000"
            "0a0b0c0d");
  EXPECT_EQ(Cdr(schema, "00 05 06 00000001 00"),
            "00000000"
            "00000000"
            "0506"
            "0000"
            "01000000"
            "00"
            "000000"
            "00000000");
}

TEST_F(RosSchemaTest, RefusesWhatIsNotAMessageOfTheType) {
  const RosSchema schema(definitions_, Define("struct a_t { int8_t n; int16_t l[n]; string s; }", "a_t"));
  EXPECT_EQ(Cdr(schema, ""), "refused");
  EXPECT_EQ(Cdr(schema, "01 00"), "refused");
  EXPECT_EQ(Cdr(schema, "ff 00000001 00"), "refused") << "a size below 0";
  EXPECT_EQ(Cdr(schema, "00 00000000"), "refused") << "a text without its NUL";
  EXPECT_EQ(Cdr(schema, "00 80000000 00"), "refused");
  EXPECT_EQ(Cdr(schema, "00 00000002 61 62"), "refused");
  EXPECT_EQ(Cdr(schema, "00 00000001 00 00"), "refused") << "more bytes than the type has";
  std::string cdr;
  EXPECT_FALSE(schema.Transcode(Bytes(), cdr));
}

TEST_F(RosSchemaTest, ALongListThatIsNotThereCostsNothing) {
  const RosSchema schema(definitions_, Define("struct a_t { int64_t n; byte l[n][1000000][1000000]; }", "a_t"));
  EXPECT_EQ(Cdr(schema, "7fffffffffffffff 00"), "refused");
}

TEST_F(RosSchemaTest, TheUnixTimeIsTheStamp) {
  const RosSchema schema(definitions_, Define("struct a_t { int64_t utime; int8_t a; }", "a_t"));
  EXPECT_EQ(schema.text().substr(0, 50), "std_msgs/Header header\nint64 utime\nint8 a\n========");
  // 1.5 s, an empty frame_id, then the fields.
  EXPECT_EQ(Cdr(schema, "000000000016e360 07"),
            "01000000"
            "0065cd1d"
            "01000000"
            "00"
            "000000"
            "60e31600"
            "00000000"
            "07");
  EXPECT_EQ(Cdr(schema, "ffffffffffffffff 07").substr(0, 16),
            "ffffffff"
            "18c69a3b")
      << "1 us before 1970";
  EXPECT_EQ(schema.UtimeOf(FromHex("0000000000000000 000000000016e360 07")), 1'500'000);
  EXPECT_EQ(schema.UtimeOf(FromHex("00")), 0);
}

TEST_F(RosSchemaTest, EachFlagIsABoolean) {
  const RosSchema schema(
      definitions_,
      Define("struct a_t { int32_t flags; const int32_t FLAG_VALID = 0x1, FLAG_LATE = 4, OTHER = 2; }", "a_t"));
  EXPECT_EQ(
      schema.text(),
      "int32 flags\nint32 FLAG_VALID=0x1\nint32 FLAG_LATE=4\nint32 OTHER=2\nbool flag_valid\nbool flag_late\n");
  EXPECT_EQ(Cdr(schema, "00000005"),
            "05000000"
            "0101");
  EXPECT_EQ(Cdr(schema, "80000002"),
            "02000080"
            "0000");
}

}  // namespace
}  // namespace axlecast
