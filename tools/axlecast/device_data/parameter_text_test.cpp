#include "tools/axlecast/device_data/parameter_text.h"

#include <gmock/gmock.h>

#include <set>

#include "tools/axlecast/common/parameter_test_family.h"

namespace axlecast {
namespace {

using ::testing::HasSubstr;

TEST(ParameterList, ShowsPresentValuesWhereTheyAreKnown) {
  const Parameters parameters = ParameterFamily().parameters;
  std::string problem;
  const ParameterValues values = FromWords(parameters, std::vector<std::string>{"power_limit=125.0"}, problem);
  ASSERT_EQ(problem, "");
  EXPECT_THAT(ListText(parameters, values), HasSubstr("power_limit"));
  EXPECT_THAT(ListText(parameters, values), HasSubstr("  125.0 W "));
  EXPECT_THAT(ListText(parameters, {}), HasSubstr("  -  "));
  const auto json = ListJson(parameters, values)["parameters"];
  ASSERT_EQ(json.size(), parameters.size());
  for (const auto& entry : json) {
    EXPECT_EQ(entry["value"].dump(), entry["name"] == "power_limit" ? "125.0" : "null");
  }
}

TEST(ParameterList, EachParameterOfARealMonitorHasADescriptionOfItsOwn) {
  std::set<std::string_view> helps;
  const Parameters parameters = FindFamily("tsubaki_sc")->parameters;
  for (const ParameterSpec& parameter : parameters) {
    EXPECT_TRUE(helps.insert(parameter.help).second) << parameter.name << ": " << parameter.help;
  }
  EXPECT_EQ(helps.size(), 55U);
}

}  // namespace
}  // namespace axlecast
