#include "core/config/config_map.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "core/config/yaml_text.h"

namespace axlecast {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;

class ConfigMapTest : public ::testing::Test {
 protected:
  ConfigMap Of(const std::string& text) { return {ParseYaml(text, errors_), "", errors_}; }

  ConfigErrors errors_{"f.yaml"};
};

TEST_F(ConfigMapTest, ReadsEveryKindOfValue) {
  ConfigMap map =
      Of("text: press3\n"
         "yes: true\n"
         "no: false\n"
         "number: 2.5e3\n"
         "hex: 0x11\n"
         "plus: +5\n"
         "list: [1, 0x10]\n"
         "bytes: \"A1 05\"\n"
         "word: cw\n");
  EXPECT_EQ(map.String("text", ""), "press3");
  EXPECT_TRUE(map.Bool("yes", false));
  EXPECT_FALSE(map.Bool("no", true));
  EXPECT_DOUBLE_EQ(map.Number("number", 0, 0, 1e6, "Hz"), 2500);
  EXPECT_EQ(map.Integer("hex", 0, 0, 255, ""), 17);
  EXPECT_EQ(map.Integer("plus", 0, 0, 255, ""), 5);
  EXPECT_THAT(map.Integers("list", 0, 79), ElementsAre(1, 16));
  EXPECT_THAT(map.HexBytes("bytes"), ElementsAre(0xA1, 0x05));
  EXPECT_EQ(map.Choice("word", {"ccw", "cw"}, 0), 1U);
  map.Done();
  EXPECT_EQ(errors_.Text(), "");
}

TEST_F(ConfigMapTest, WhatIsAbsentIsTheDefault) {
  ConfigMap map = Of("a: 1\n");
  EXPECT_FALSE(map.Has("text"));
  EXPECT_EQ(map.String("text", "default"), "default");
  EXPECT_TRUE(map.Bool("flag", true));
  EXPECT_DOUBLE_EQ(map.Number("number", 7, 0, 10, ""), 7);
  EXPECT_EQ(map.Integer("integer", 8, 0, 10, ""), 8);
  EXPECT_EQ(map.Choice("word", {"a", "b"}, 1), 1U);
  EXPECT_THAT(map.Integers("list", 0, 1), IsEmpty());
  EXPECT_THAT(map.HexBytes("bytes"), IsEmpty());
  EXPECT_THAT(map.Maps("maps"), IsEmpty());
  EXPECT_THAT(map.List("maps"), IsEmpty());
  EXPECT_EQ(map.Map("map").String("inner", "x"), "x");
  EXPECT_EQ(errors_.Text(), "");
}

// Each mistake: the content of the file, its reader, and the whole message.
TEST_F(ConfigMapTest, EveryMistakeNamesPlaceValueAndWhatIsRight) {
  ConfigMap map =
      Of("a: yes\n"
         "b:   12x\n"
         "c: 7001\n"
         "d: 2.5\n"
         "e: [1, 80, x]\n"
         "f: A1 5\n"
         "g: cv\n"
         "h: {i: 1}\n"
         "j:\n"
         "k: nan\n"
         "l: 99999999999999999999\n"
         "m: text\n");
  EXPECT_TRUE(map.Bool("a", true));
  EXPECT_DOUBLE_EQ(map.Number("b", 1, 0, 20'000, "Hz"), 1);
  EXPECT_DOUBLE_EQ(map.Number("c", 1, 0, 6'000, "rpm"), 1);
  EXPECT_EQ(map.Integer("d", 3, 0, 9, ""), 3);
  EXPECT_THAT(map.Integers("e", 0, 79), ElementsAre(1));
  EXPECT_THAT(map.HexBytes("f"), IsEmpty());
  EXPECT_EQ(map.Choice("g", {"ccw", "cw"}, 0), 0U);
  EXPECT_EQ(map.String("h", "x"), "x");
  EXPECT_EQ(map.RequiredString("j"), "");
  EXPECT_DOUBLE_EQ(map.Number("k", 1, 0, 5, "mm"), 1);
  EXPECT_EQ(map.Integer("l", 4, 0, 9, ""), 4);
  EXPECT_EQ(map.Map("m").String("inner", "x"), "x");
  EXPECT_EQ(map.RequiredString("z"), "");
  EXPECT_FALSE(map.Require("y", "one of p, q"));
  EXPECT_EQ(errors_.Text(),
            "f.yaml:1:1: z: is missing\n"
            "f.yaml:1:1: y: is missing: one of p, q\n"
            "f.yaml:1:4: a: 'yes' is not true or false\n"
            "f.yaml:2:6: b: '12x' is not a number (0 to 20000 Hz)\n"
            "f.yaml:3:4: c: '7001' is not within 0 to 6000 rpm\n"
            "f.yaml:4:4: d: '2.5' is not a whole number (0 to 9)\n"
            "f.yaml:5:8: e: '80' is not a whole number (0 to 79)\n"
            "f.yaml:5:12: e: 'x' is not a whole number (0 to 79)\n"
            "f.yaml:6:4: f: 'A1 5' is not bytes in hex, two digits each: \"A1 05\"\n"
            "f.yaml:7:4: g: 'cv' is not one of ccw, cw; did you mean 'cw'?\n"
            "f.yaml:8:4: h: a mapping is given where a text is expected\n"
            "f.yaml:9:1: j: nothing is given where a text is expected\n"
            "f.yaml:10:4: k: 'nan' is not a number (0 to 5 mm)\n"
            "f.yaml:11:4: l: '99999999999999999999' is not a whole number (0 to 9)\n"
            "f.yaml:12:4: m: 'text' is given where a mapping (key: value) is expected\n");
}

TEST_F(ConfigMapTest, AnUnknownKeyIsAnsweredWithTheNearestKnown) {
  ConfigMap map = Of("outer:\n  spedd_rpm: 3\n  frobnicate: 1\n");
  ConfigMap outer = map.Map("outer");
  static_cast<void>(outer.Number("speed_rpm", 0, 0, 1, ""));
  static_cast<void>(outer.Number("accel", 0, 0, 1, ""));
  outer.Done();
  map.Done();
  EXPECT_EQ(errors_.Text(),
            "f.yaml:2:3: outer: unknown key 'spedd_rpm'; did you mean 'speed_rpm'?\n"
            "f.yaml:3:3: outer: unknown key 'frobnicate'; known here: accel, speed_rpm\n");
}

TEST_F(ConfigMapTest, MapsKeepTheFilesOrderAndListsTheirIndex) {
  ConfigMap map = Of("buses: {z: {a: 1}, b: {a: 2}, empty: }\nscript: [{at_s: 1}, {at_s: x}]\n");
  auto maps = map.Maps("buses");
  ASSERT_EQ(maps.size(), 3U);
  EXPECT_EQ(maps[0].first, "z");
  EXPECT_EQ(maps[1].first, "b");
  EXPECT_EQ(maps[1].second.path(), "buses.b");
  EXPECT_EQ(maps[1].second.line(), 1);
  auto list = map.List("script");
  ASSERT_EQ(list.size(), 2U);
  static_cast<void>(list[1].Number("at_s", 0, 0, 10, "s"));
  EXPECT_EQ(errors_.Text(),
            "f.yaml:1:31: buses.empty: is empty; a mapping (key: value) is expected\n"
            "f.yaml:2:28: script[1].at_s: 'x' is not a number (0 to 10 s)\n");
}

TEST_F(ConfigMapTest, AliasesStandForWhatTheyName) {
  ConfigMap map = Of("a: &x {speed: 7}\nb: *x\n");
  EXPECT_EQ(map.Map("b").Integer("speed", 0, 0, 9, ""), 7);
  EXPECT_EQ(errors_.Text(), "");
}

TEST_F(ConfigMapTest, LongAndUnprintableValuesAreShownShort) {
  ConfigMap map = Of("a: \"x\\e[31m" + std::string(500, 'y') + "\"\n");
  static_cast<void>(map.Integer("a", 0, 0, 9, ""));
  EXPECT_THAT(errors_.Text(), HasSubstr("a: 'x\uFFFD[31myyy"));
  EXPECT_LT(errors_.Text().size(), 120U);
}

TEST_F(ConfigMapTest, ErrorsOfATextWithinAFileCountFromItsFirstLine) {
  ConfigErrors errors("f.yaml", 40);
  ConfigMap map(ParseYaml("a: 1\nb: x\n", errors), "", errors);
  static_cast<void>(map.Integer("b", 0, 0, 9, ""));
  EXPECT_EQ(errors.list().at(0).line, 41);
}

// ---- the text itself ----

std::string TextErrors(const std::string& text) {
  ConfigErrors errors("f.yaml");
  const YAML::Node node = ParseYaml(text, errors);
  EXPECT_TRUE(node.IsDefined() || !errors.empty());
  return errors.Text();
}

TEST(ParseYaml, SyntaxErrorsNameLineAndColumn) {
  EXPECT_THAT(TextErrors("machine: a\nbuses: {b: [1, 2\n"), HasSubstr("f.yaml:3:1: not YAML: "));
}

TEST(ParseYaml, ATabInTheIndentationIsNamed) {
  const std::string errors = TextErrors("machine: a\nbuses:\n\tb: 1\n");
  EXPECT_THAT(errors, HasSubstr("f.yaml:3:"));
  EXPECT_THAT(errors, HasSubstr("the indentation contains a tab: use spaces"));
}

TEST(ParseYaml, AKeyThatStandsTwiceIsRefusedAtEveryDepth) {
  EXPECT_EQ(TextErrors("a: 1\nb:\n  c: 1\n  d: [{e: 1, e: 2}]\n  c: 2\na: 3\n"),
            "f.yaml:4:14: key 'e' is given twice here; the first is in line 4\n"
            "f.yaml:5:3: key 'c' is given twice here; the first is in line 3\n"
            "f.yaml:6:1: key 'a' is given twice here; the first is in line 1\n");
}

TEST(ParseYaml, TakesOneDocumentWithPlainKeys) {
  EXPECT_THAT(TextErrors("a: 1\n---\nb: 2\n"),
              HasSubstr("f.yaml:2:1: what begins here does not belong to the document"));
  EXPECT_THAT(TextErrors(", a: 1\n"), HasSubstr("f.yaml:1:1: "));
  EXPECT_EQ(TextErrors("[a, b]: 1\n"), "f.yaml:1:1: a key must be plain text\n");
  EXPECT_THAT(TextErrors("# nothing\n"), HasSubstr("f.yaml: the file is empty"));
}

TEST(ParseYaml, EndsOnSizeDepthAndAliasBombs) {
  EXPECT_THAT(TextErrors(std::string(600'000, ' ')), HasSubstr("600000 bytes"));
  for (const std::size_t depth : {40U, 400U, 20'000U, 400'000U}) {
    EXPECT_NE(TextErrors(std::string(depth, '[')), "") << depth;
  }
  EXPECT_THAT(TextErrors(std::string(40, '[') + std::string(40, ']')), HasSubstr("nested deeper than 32 levels"));
  std::string bomb = "a0: &a0 [x, x, x, x, x, x, x, x, x, x]\n";
  for (int i = 1; i < 9; ++i) {
    const std::string last = "*a" + std::to_string(i - 1);
    const std::string name = "a" + std::to_string(i);
    bomb += name + ": &" + name + " [";
    for (int j = 0; j < 9; ++j) bomb += last + ", ";
    bomb += last + "]\n";
  }
  EXPECT_THAT(TextErrors(bomb), HasSubstr("more than 100000 values"));
}

const ConfigKey* Find(const ConfigErrors& errors, const std::string& place) {
  for (const ConfigKey& key : errors.keys()) {
    if (key.place == place) return &key;
  }
  return nullptr;
}

TEST_F(ConfigMapTest, TellsWhichKeysItWasAskedFor) {
  ConfigMap map = Of("buses: {a: {hz: 5}, b: {}}\nlist: [{x: 1}]\n");
  static_cast<void>(map.RequiredString("machine"));
  for (auto& [name, bus] : map.Maps("buses")) {
    static_cast<void>(bus.Has("hz"));
    static_cast<void>(bus.Number("hz", 2.5, 0, 1e3, "Hz"));
    static_cast<void>(bus.Has("hz"));
    bus.Require("sense", "");
    static_cast<void>(bus.Choice("sense", {"ccw", "cw"}, 1));
    static_cast<void>(bus.Map("link").Bool("echo", false));
    static_cast<void>(bus.Empty("simulate").Named("axis1").Integer("rpm", 0, -1, 1, ""));
  }
  for (ConfigMap& item : map.List("list")) static_cast<void>(item.String("x", "d"));

  std::vector<std::string> places;
  for (const ConfigKey& key : errors_.keys()) places.push_back(key.place);
  EXPECT_THAT(places,
              ElementsAre("machine", "buses", "buses.<name>.hz", "buses.<name>.sense", "buses.<name>.link",
                          "buses.<name>.link.echo", "buses.<name>.simulate.<name>.rpm", "list", "list[].x"));
  EXPECT_TRUE(Find(errors_, "machine")->required);
  EXPECT_TRUE(Find(errors_, "buses.<name>.sense")->required);
  EXPECT_EQ(Find(errors_, "machine")->kind, "text");
  EXPECT_EQ(Find(errors_, "buses.<name>.hz")->kind, "number");
  EXPECT_EQ(Find(errors_, "buses.<name>.hz")->range, "0 to 1000 Hz");
  EXPECT_EQ(Find(errors_, "buses.<name>.hz")->fallback, "2.5");
  EXPECT_EQ(Find(errors_, "buses.<name>.sense")->range, "ccw, cw");
  EXPECT_EQ(Find(errors_, "buses.<name>.sense")->fallback, "cw");
}

TEST_F(ConfigMapTest, ADefaultThatNobodyCouldWriteIsNone) {
  ConfigMap map = Of("x: 1\n");
  map.MarkRequired("bits");
  static_cast<void>(map.Integer("bits", 16, 10, 26, "bits"));
  static_cast<void>(map.Integer("port", 0, 1, 65'535, ""));
  static_cast<void>(map.Number("modulo", 0, 1e-9, 1, "mm"));
  static_cast<void>(map.Time("keep", 0));
  static_cast<void>(map.Time("interval", 10 * kSecond));
  static_cast<void>(map.Size("quota", 0));
  static_cast<void>(map.Size("buffer", 64 << 20));
  EXPECT_TRUE(Find(errors_, "bits")->required);
  EXPECT_EQ(Find(errors_, "bits")->kind, "whole number");
  EXPECT_EQ(Find(errors_, "port")->fallback, "");
  EXPECT_EQ(Find(errors_, "modulo")->fallback, "");
  EXPECT_EQ(Find(errors_, "keep")->fallback, "");
  EXPECT_EQ(Find(errors_, "interval")->fallback, "10s");
  EXPECT_EQ(Find(errors_, "quota")->fallback, "");
  EXPECT_EQ(Find(errors_, "buffer")->fallback, "64MB");
  EXPECT_EQ(errors_.Text(), "");
}

TEST_F(ConfigMapTest, ReadsTimesAndSizes) {
  ConfigMap map = Of("keep: 2h\nquota: 20GB\nshort: 5\nsmall: 1 GB\nlist: [1s]\n");
  EXPECT_EQ(map.Time("keep", 0), 7'200 * kSecond);
  EXPECT_EQ(map.Size("quota", 0), std::int64_t{20} << 30);
  EXPECT_EQ(map.Time("short", kSecond), kSecond);
  EXPECT_EQ(map.Size("small", 7), 7);
  EXPECT_EQ(map.Time("list", kSecond), kSecond);
  EXPECT_EQ(errors_.Text(),
            "f.yaml:3:8: short: '5' is not a time: 90s, 15m, 1h, 14d, 2w or 5y\n"
            "f.yaml:4:8: small: '1 GB' is not a size: 512kB, 100MB, 20GB or 1TB\n"
            "f.yaml:5:7: list: a list is given where a time is expected\n");
}

}  // namespace
}  // namespace axlecast
