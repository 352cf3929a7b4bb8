#include "core/config/abbreviations.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "core/config/yaml_text.h"

namespace axlecast {
namespace {

using testing::HasSubstr;

class AbbreviationsTest : public testing::Test {
 protected:
  // The expanded document; both texts are read by the same parser, so that layout does not count.
  std::string Expanded(const std::string& text) {
    return YamlText(ExpandAbbreviations(ParseYaml(text, errors_), errors_));
  }
  std::string Same(const std::string& text) {
    ConfigErrors none("");
    return YamlText(ParseYaml(text, none));
  }
  // The document in one canonical form.
  std::int64_t Hash(const std::string& text) {
    ConfigErrors none("");
    return ConfigHash(ParseYaml(text, none));
  }

  ConfigErrors errors_{"machine.yaml"};
};

TEST_F(AbbreviationsTest, ADocumentWithoutThemIsReturnedItself) {
  const YAML::Node document = ParseYaml("machine: m\nbuses: {a: {devices: {x: {model: y}}}}\n", errors_);
  EXPECT_TRUE(ExpandAbbreviations(document, errors_).is(document));
}

TEST_F(AbbreviationsTest, ARangeMakesNamesAndFillsInItsNumber) {
  EXPECT_EQ(
      Hash(Expanded(
          "buses:\n  b{08..10}:\n    link: {port: '/dev/tty{}'}\n    devices:\n      axis{}: {address: '{n}'}\n")),
      Hash("buses: {b08: {link: {port: /dev/tty08}, devices: {axis08: {address: 8}}},"
           "        b09: {link: {port: /dev/tty09}, devices: {axis09: {address: 9}}},"
           "        b10: {link: {port: /dev/tty10}, devices: {axis10: {address: 10}}}}"));
  EXPECT_TRUE(errors_.empty()) << errors_.Text();
}

TEST_F(AbbreviationsTest, ARangeWithinARangeHasItsOwnNumber) {
  EXPECT_EQ(Hash(Expanded("buses:\n  b{1..2}:\n    devices:\n      a{}-{1..2}: {address: '{n}'}\n")),
            Hash("buses: {b1: {devices: {a1-1: {address: 1}, a1-2: {address: 2}}},"
                 "        b2: {devices: {a2-1: {address: 1}, a2-2: {address: 2}}}}"));
}

TEST_F(AbbreviationsTest, DefaultsOfFamilyAndBusFillWhatIsMissing) {
  EXPECT_EQ(Hash(Expanded(
                "defaults:\n"
                "  tformat: {poll_hz: 1000, link: {baud: 2500000}, devices: {unit: deg, limits: {speed_rpm: 1}}}\n"
                "buses:\n"
                "  b0:\n"
                "    family: tformat\n"
                "    link: {port: /dev/a}\n"
                "    defaults: {model: x, limits: {accel_rad_s2: 2}}\n"
                "    devices: {a: {limits: {speed_rpm: 9}}, b: {unit: mm, per_turn: 5}, c: }\n"
                "  b1: {family: ssi, devices: {d: {}}}\n")),
            Hash("buses:\n"
                 "  b0:\n"
                 "    family: tformat\n"
                 "    poll_hz: 1000\n"
                 "    link: {port: /dev/a, baud: 2500000}\n"
                 "    devices:\n"
                 "      a: {model: x, unit: deg, limits: {speed_rpm: 9, accel_rad_s2: 2}}\n"
                 "      b: {model: x, unit: mm, per_turn: 5, limits: {speed_rpm: 1, accel_rad_s2: 2}}\n"
                 "      c: {model: x, unit: deg, limits: {speed_rpm: 1, accel_rad_s2: 2}}\n"
                 "  b1: {family: ssi, devices: {d: {}}}\n"));
  EXPECT_TRUE(errors_.empty()) << errors_.Text();
}

// YAML 1.1, tag:yaml.org,2002:merge: own keys count, then the earlier mapping of a list.
TEST_F(AbbreviationsTest, MergeKeys) {
  EXPECT_EQ(Hash(Expanded("a: &a {x: 1, y: 1}\nb: &b {y: 2, z: 2}\nc: {<<: [*a, *b], x: 3}\nd: {<<: *b}\n")),
            Hash("a: {x: 1, y: 1}\nb: {y: 2, z: 2}\nc: {x: 3, y: 1, z: 2}\nd: {y: 2, z: 2}\n"));
}

// An anchor that two buses share must not collect what the defaults add to one of them.
TEST_F(AbbreviationsTest, SharedNodesStayAsTheyAre) {
  EXPECT_EQ(Hash(Expanded("defaults: {tformat: {link: {baud: 1}}}\n"
                          "buses:\n"
                          "  b0: {family: tformat, link: &l {port: /dev/a}}\n"
                          "  b1: {family: ssi, link: *l}\n")),
            Hash("buses: {b0: {family: tformat, link: {port: /dev/a, baud: 1}}, b1: {family: ssi, link: {port: "
                 "/dev/a}}}"));
}

TEST_F(AbbreviationsTest, MistakesAreReportedWithTheirLine) {
  static_cast<void>(
      Expanded("defaults: {tformt: {}}\n"
               "buses:\n"
               "  b{9..1}: {family: tformat}\n"
               "  c{1..2}: {family: tformat}\n"
               "  c2: {family: tformat}\n"
               "d: {<<: 5}\n"));
  const std::string text = errors_.Text();
  EXPECT_THAT(text, HasSubstr("machine.yaml:1:12: defaults: no bus of this file has the family 'tformt'"));
  EXPECT_THAT(text, HasSubstr("machine.yaml:3:3: 'b{9..1}' is a range that ends before it begins"));
  EXPECT_THAT(text, HasSubstr("machine.yaml:5:3: 'c2' is given twice"));
  EXPECT_THAT(text, HasSubstr("machine.yaml:6:5: <<: needs a mapping"));
}

TEST_F(AbbreviationsTest, DefaultsMustBeAMapping) {
  static_cast<void>(Expanded("defaults: 5\nbuses: {}\n"));
  EXPECT_THAT(errors_.Text(), HasSubstr("defaults: needs a mapping"));
}

TEST_F(AbbreviationsTest, RangesThatMakeTooMuchAreRefusedAtOnce) {
  static_cast<void>(Expanded("buses:\n  b{1..9999}:\n    devices:\n      a{1..9999}: {model: x}\n"));
  EXPECT_THAT(errors_.Text(), HasSubstr("more than 100000 values"));
}

// yaml-cpp's bookkeeping must not make it quadratic: this is a hundred thousand values.
TEST_F(AbbreviationsTest, ManyNamesAreMadeInOneGo) {
  const YAML::Node document =
      ParseYaml("buses:\n  b{1..99}:\n    devices:\n      a{}-{1..99}: {model: x, unit: y, z: 1}\n", errors_);
  const YAML::Node expanded = ExpandAbbreviations(document, errors_);
  EXPECT_TRUE(errors_.empty()) << errors_.Text();
  EXPECT_EQ(expanded["buses"]["b99"]["devices"].size(), 99U);
}

// A name or value may contain braces that are not a range.
TEST_F(AbbreviationsTest, OtherBracesStay) {
  for (const char* text : {"buses: {'a{b..c}': {}}\n", "buses: {'a{1..}': {}}\n", "buses: {'a{}': {x: '{n}'}}\n",
                           "buses: {'}a..{': {}}\n", "recorder: {'log{1..2}': 1}\n"}) {
    EXPECT_EQ(Hash(Expanded(text)), Hash(text)) << text;
  }
}

}  // namespace
}  // namespace axlecast
