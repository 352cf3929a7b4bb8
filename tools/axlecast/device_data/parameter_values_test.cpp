#include "tools/axlecast/device_data/parameter_values.h"

#include <gmock/gmock.h>

#include "tools/axlecast/common/parameter_test_family.h"

namespace axlecast {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;

std::vector<std::string> Texts(const ParameterValues& values) {
  std::vector<std::string> texts;
  for (const ParameterValue& value : values)
    texts.push_back(std::string(value.parameter->name) + " " + ValueText(value));
  return texts;
}

ParameterValues Registers(const std::vector<change_t>& changes, std::string& problem) {
  return FromRegisters(ParameterFamily().parameters, changes, problem);
}

change_t Read(const std::string& key, const std::string& after) { return {key, "", after}; }

TEST(FromRegisters, PutsBlocksTogetherByTheirAddresses) {
  std::string problem;
  const auto values =
      Registers({Read("registers 0-1", "04E20005"), Read("registers 4-6", "FFFF0BB80000")}, problem);
  EXPECT_EQ(problem, "");
  EXPECT_THAT(Texts(values), ElementsAre("power_limit 125.0 W", "start_time 0.5 s", "shock_limit 30.00 m/s2"));
}

TEST(FromRegisters, ZeroSwitchesALimitOff) {
  std::string problem;
  EXPECT_THAT(Texts(Registers({Read("registers 0-5", "000000010000000000000000")}, problem)),
              ElementsAre("power_limit 0.0 W (off)", "start_time 0.1 s", "shock_limit 0.00 m/s2 (off)"));
}

TEST(FromRegisters, WhatIsMalformedOrMissingIsToldNotGuessed) {
  const std::vector<std::pair<change_t, std::string>> cases = {
      {Read("registers 0-1", "04E2000"), "no registers"},
      {Read("registers 0-1", "04E20005000F"), "no registers"},
      {Read("registers 0-1", "04E2000G"), "no registers"},
      {Read("registers 1-0", "04E20005"), "no registers"},
      {Read("registers 0-99999", "04E20005"), "no registers"},
      {Read("registers -", ""), "no registers"},
      {Read("registers ", ""), "no registers"},
      {Read("finding", "reads_as_after"), "no registers"},
      {Read("registers 0-1", "04E20005"), "did not tell shock_limit"}};
  for (const auto& [change, says] : cases) {
    std::string problem;
    EXPECT_THAT(Registers({change}, problem), IsEmpty()) << change.key;
    EXPECT_THAT(problem, HasSubstr(says)) << change.key;
  }
}

TEST(FromWords, AreInTheOrderOfTheFamily) {
  std::string problem;
  const std::vector<std::string> words = {"shock_limit=30", "power_limit=125.0"};
  EXPECT_THAT(Texts(FromWords(ParameterFamily().parameters, words, problem)),
              ElementsAre("power_limit 125.0 W", "shock_limit 30.00 m/s2"));
}

TEST(FromWords, EachMistakeIsNamedWithWhatWouldBeRight) {
  const std::vector<std::pair<std::string, std::string>> cases = {
      {"power_limit", "no NAME=VALUE: write power_limit=VALUE"},
      {"=5", "no NAME=VALUE"},
      {"power_limt=5", "did you mean 'power_limit'"},
      {"bogus=5", "param list"},
      {"power_limit=1000.1", "0.0 to 1000.0 W"},
      {"power_limit=1.25", "steps of 0.1 W"},
      {"start_time=0", "0.1 to 5.0 s"},
      {"start_time=fast", "must be a number"},
      {"start_time=-1", "must be a number"},
      {"start_time=", "must be a number"}};
  for (const auto& [word, says] : cases) {
    std::string problem;
    EXPECT_THAT(FromWords(ParameterFamily().parameters, std::vector{word}, problem), IsEmpty()) << word;
    EXPECT_THAT(problem, HasSubstr(says)) << word;
  }
  std::string problem;
  const std::vector<std::string> twice = {"start_time=1", "start_time=2"};
  EXPECT_THAT(FromWords(ParameterFamily().parameters, twice, problem), IsEmpty());
  EXPECT_THAT(problem, HasSubstr("given twice"));
}

}  // namespace
}  // namespace axlecast
