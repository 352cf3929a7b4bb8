#include "tools/foxglove/lcm_definition.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <axlecast/alarm_t.hpp>
#include <axlecast/device_info_t.hpp>
#include <axlecast/position_set_t.hpp>
#include <axlecast/position_t.hpp>
#include <string>
#include <vector>

#include "tools/recorder/log_composer.h"

namespace axlecast {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::SizeIs;

std::string ErrorOf(const std::string& text) { return ErrorText(LcmDefinitions().Add(text)); }

TEST(LcmDefinitions, HaveTheFingerprintsOfLcmGen) {
  LcmDefinitions definitions;
  ASSERT_TRUE(definitions.Add(SchemaText()));
  ASSERT_THAT(definitions.Finish(), IsEmpty());
  ASSERT_NE(definitions.Find(position_t::getHash()), nullptr);
  EXPECT_EQ(definitions.Find(position_t::getHash())->FullName(), "axlecast.position_t");
  EXPECT_EQ(definitions.Find(alarm_t::getHash()), definitions.Find("axlecast.alarm_t")) << "contains other structs";
  EXPECT_EQ(definitions.Find(device_info_t::getHash()), definitions.Find("axlecast.device_info_t"));
  EXPECT_EQ(definitions.Find(position_set_t::getHash()), definitions.Find("axlecast.position_set_t"));
  EXPECT_EQ(definitions.Find(std::int64_t{1}), nullptr);
}

TEST(LcmDefinitions, ReadEveryKindOfField) {
  LcmDefinitions definitions;
  ASSERT_TRUE(definitions.Add(R"(package a.b; // one
/* struct not_t {} */
struct point_t { double x, y; }
struct shape_t {
  const int32_t ROUND = 1, FLAT = 0x2; const double HALF = -0.5e-3;
  int16_t n;
  point_t points[n][3];
  c.other_t other;
  byte raw[4];
})"));
  const LcmStruct* const shape = definitions.Find("a.b.shape_t");
  ASSERT_NE(shape, nullptr);
  ASSERT_THAT(shape->fields, SizeIs(4));
  EXPECT_EQ(shape->fields[1].type, "a.b.point_t");
  EXPECT_FALSE(shape->fields[1].dimensions[0].is_constant);
  EXPECT_EQ(shape->fields[1].dimensions[1].constant, 3U);
  EXPECT_EQ(shape->fields[2].type, "c.other_t");
  EXPECT_EQ(shape->fields[3].kind, LcmKind::kByte);
  ASSERT_THAT(shape->constants, SizeIs(3));
  EXPECT_EQ(shape->constants[1].value, "0x2");
  EXPECT_EQ(shape->constants[2].value, "-0.5e-3");
  EXPECT_THAT(definitions.Finish(),
              ElementsAre(HasSubstr("a.b.shape_t: the type c.other_t is not known: give its file too")));
  EXPECT_EQ(definitions.Find("a.b.point_t")->fields[1].name, "y");
}

TEST(LcmDefinitions, NameTheLineOfAnError) {
  EXPECT_EQ(ErrorOf("\n\nenum e_t { A }"), "line 3: expected package or struct, not 'enum'");
  EXPECT_EQ(ErrorOf("struct a_t {"), "line 1: expected a type, not the end");
  EXPECT_EQ(ErrorOf("struct a_t { int8_t; }"), "line 1: expected a name of a field, not ';'");
  EXPECT_EQ(ErrorOf("struct a_t { int8_t a[n]; }"),
            "line 1: expected a size: a number, or an integer field before it, not 'n'");
  EXPECT_EQ(ErrorOf("struct a_t { string n; int8_t a[n]; }"),
            "line 1: expected a size: a number, or an integer field before it, not 'n'");
  EXPECT_EQ(ErrorOf("struct a_t { const string A = 1; }"), "line 1: expected the type of a constant, not 'string'");
  EXPECT_EQ(ErrorOf("struct a_t { const int8_t A = ; }"), "line 1: expected a number, not ';'");
  EXPECT_EQ(ErrorOf("struct 5 { }"), "line 1: expected a name of a struct, not '5'");
  EXPECT_EQ(ErrorOf("/* \n */ /* never closed"), "");
}

TEST(LcmDefinitions, RefuseTypesThatContainThemselves) {
  LcmDefinitions definitions;
  ASSERT_TRUE(definitions.Add("struct a_t { b_t b; } struct b_t { a_t a[2]; } struct c_t { int8_t c; }"));
  EXPECT_THAT(definitions.Finish(),
              ElementsAre(HasSubstr("a_t: its structs contain each other"), HasSubstr("b_t: ")));
  EXPECT_NE(definitions.Find("c_t"), nullptr);
}

TEST(LcmDefinitions, ReplaceATypeThatComesAgain) {
  LcmDefinitions definitions;
  ASSERT_TRUE(definitions.Add("struct a_t { int8_t a; }"));
  ASSERT_TRUE(definitions.Add("struct a_t { int8_t b; }"));
  EXPECT_THAT(definitions.Finish(), IsEmpty());
  EXPECT_EQ(definitions.Find("a_t")->fields[0].name, "b");
}

TEST(LcmDefinitions, LimitTheirSize) {
  LcmDefinitions definitions;
  EXPECT_TRUE(definitions.Add(std::string(LcmDefinitions::kMaxText, ' ')));
  EXPECT_EQ(ErrorText(definitions.Add(" ")), "the definitions are larger than 4 MB");
}

}  // namespace
}  // namespace axlecast
