#include "drivers/tsubaki_sc/register_map.h"

#include <gmock/gmock.h>
#include <set>

#include "core/base/result.h"

namespace axlecast::tsubaki_sc {
namespace {

struct Row {
  int address;
  const char* name;
  const char* unit;
  int min;
  int max;
  bool zero_disables;
};

// Guideline 11, DIP switch setting No.1, and what holds for all; No.2 to 4 follow 13 registers apart.
constexpr int kRowsOfASet = 13;
constexpr Row kFirstSet[kRowsOfASet] = {
    {0, "power_upper_a_1_50hz", "W", 0, 10'000, true},
    {1, "power_upper_a_1_60hz", "W", 0, 10'000, true},
    {2, "power_upper_b_1_50hz", "W", 0, 10'000, true},
    {3, "power_upper_b_1_60hz", "W", 0, 10'000, true},
    {4, "power_lower_a_1_50hz", "W", 0, 10'000, true},
    {5, "power_lower_a_1_60hz", "W", 0, 10'000, true},
    {6, "power_lower_b_1_50hz", "W", 0, 10'000, true},
    {7, "power_lower_b_1_60hz", "W", 0, 10'000, true},
    {8, "start_time_1", "s", 1, 50, false},
    {9, "shock_time_upper_a_1", "s", 0, 300, false},
    {10, "shock_time_upper_b_1", "s", 0, 300, false},
    {11, "shock_time_lower_a_1", "s", 0, 300, false},
    {12, "shock_time_lower_b_1", "s", 0, 300, false},
};
constexpr Row kForAllSets[] = {
    {52, "overheat_limit", "degC", 0, 1'250, true},
    {53, "excessive_shock_limit", "m/s2", 0, 15'000, true},
    {54, "log_interval", "s", 1, 100, false},
};

void ExpectRow(const Row& row, int address, const std::string& name) {
  SCOPED_TRACE(name);
  const ParameterSpec* parameter = FindParameter(name);
  ASSERT_NE(parameter, nullptr);
  EXPECT_EQ(parameter->address, address);
  EXPECT_EQ(parameter->unit, row.unit);
  EXPECT_EQ(parameter->decimals, parameter->unit == "m/s2" ? 2 : 1);
  EXPECT_EQ(parameter->min, row.min);
  EXPECT_EQ(parameter->max, row.max);
  EXPECT_EQ(parameter->zero_disables, row.zero_disables);
}

TEST(Parameters, AreThoseOfTheGuidelineForFourDipSettingsAndBothFrequencies) {
  for (int set = 1; set <= 4; ++set) {
    for (const Row& row : kFirstSet) {
      std::string name = row.name;
      name[name.find('1')] = static_cast<char>('0' + set);
      ExpectRow(row, row.address + kRowsOfASet * (set - 1), name);
    }
  }
  for (const Row& row : kForAllSets) ExpectRow(row, row.address, row.name);
}

TEST(Parameters, StandInTheOrderOfTheirAddressesUnderNamesOfTheirOwn) {
  ASSERT_EQ(Parameters().size(), 55U);
  std::set<std::string_view> names;
  for (std::size_t i = 0; i < Parameters().size(); ++i) {
    EXPECT_EQ(Parameters()[i].address, i);
    EXPECT_TRUE(names.insert(Parameters()[i].name).second);
    EXPECT_LE(Parameters()[i].name.size(), 24U) << "a change_t holds it";
  }
  EXPECT_EQ(FindParameter("power_upper_a_5_50hz"), nullptr);
  EXPECT_EQ(FindParameter(""), nullptr);
}

std::optional<std::uint16_t> Parsed(const char* name, const char* text) {
  const auto value = ParseParameter(*FindParameter(name), text);
  EXPECT_EQ(value.has_value(), ErrorText(value).empty()) << text;
  return value ? std::optional(*value) : std::nullopt;
}

TEST(Parameters, AreReadInTheirUnit) {
  EXPECT_EQ(Parsed("power_upper_a_1_50hz", "125"), 1'250);
  EXPECT_EQ(Parsed("power_upper_a_1_50hz", "125.0"), 1'250);
  EXPECT_EQ(Parsed("power_upper_a_1_50hz", "125.30"), 1'253);
  EXPECT_EQ(Parsed("power_upper_a_1_50hz", "125.3 W"), 1'253);
  EXPECT_EQ(Parsed("power_upper_a_1_50hz", ".5"), 5);
  EXPECT_EQ(Parsed("power_upper_a_1_50hz", "0"), 0);
  EXPECT_EQ(Parsed("power_upper_a_1_50hz", "1000"), 10'000);
  EXPECT_EQ(Parsed("excessive_shock_limit", "9.81"), 981);
  EXPECT_EQ(Parsed("excessive_shock_limit", "150 m/s2"), 15'000);
  EXPECT_EQ(Parsed("overheat_limit", "125 degC"), 1'250);
  EXPECT_EQ(Parsed("start_time_4", "0.1"), 1);
  EXPECT_EQ(Parsed("log_interval", "10"), 100);
}

TEST(Parameters, OutOfRangeOrNotANumberIsRefusedWithWhatWouldBeRight) {
  const struct {
    const char* name;
    const char* text;
    const char* problem;
  } kCases[] = {
      {"power_upper_a_1_50hz", "1000.1", "power_upper_a_1_50hz must be 0.0 to 1000.0 W"},
      {"power_lower_b_4_60hz", "-1", "power_lower_b_4_60hz must be a number, 0.0 to 1000.0 W"},
      {"start_time_1", "0", "start_time_1 must be 0.1 to 5.0 s"},
      {"start_time_1", "5.1", "start_time_1 must be 0.1 to 5.0 s"},
      {"shock_time_upper_a_2", "30.1", "shock_time_upper_a_2 must be 0.0 to 30.0 s"},
      {"overheat_limit", "125.1", "overheat_limit must be 0.0 to 125.0 degC"},
      {"excessive_shock_limit", "150.01", "excessive_shock_limit must be 0.00 to 150.00 m/s2"},
      {"excessive_shock_limit", "9.815", "excessive_shock_limit has steps of 0.01 m/s2"},
      {"log_interval", "0.0", "log_interval must be 0.1 to 10.0 s"},
      {"log_interval", "10.1", "log_interval must be 0.1 to 10.0 s"},
      {"log_interval", "0.25", "log_interval has steps of 0.1 s"},
      {"log_interval", "", "log_interval must be a number, 0.1 to 10.0 s"},
      {"log_interval", ".", "log_interval must be a number"},
      {"log_interval", "1,5", "log_interval must be a number"},
      {"log_interval", "1.5.0", "log_interval must be a number"},
      {"log_interval", "0x10", "log_interval must be a number"},
      {"log_interval", "1 W", "log_interval must be a number"},
      {"log_interval", "99999999999999999999", "log_interval must be a number"},
  };
  for (const auto& c : kCases) {
    const auto value = ParseParameter(*FindParameter(c.name), c.text);
    ASSERT_FALSE(value) << c.name << ' ' << c.text;
    EXPECT_THAT(value.error().text, testing::StartsWith(c.problem));
  }
}

TEST(Parameters, AreShownInTheirUnit) {
  EXPECT_EQ(ParameterText(*FindParameter("power_upper_a_1_50hz"), 1'253), "125.3");
  EXPECT_EQ(ParameterText(*FindParameter("power_upper_a_1_50hz"), 5), "0.5");
  EXPECT_EQ(ParameterText(*FindParameter("excessive_shock_limit"), 5), "0.05");
  EXPECT_EQ(ParameterText(*FindParameter("excessive_shock_limit"), 0xFFFF), "655.35");
}

}  // namespace

}  // namespace axlecast::tsubaki_sc
