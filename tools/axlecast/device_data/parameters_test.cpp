#include <gmock/gmock.h>
#include <set>

#include "tools/axlecast/common/test_monitor.h"
#include "tools/axlecast/device_data/device_access.h"
#include "tools/axlecast/device_data/parameters.h"

namespace axlecast {
namespace {

using ::testing::AllOf;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::Pair;
using ::testing::SizeIs;

std::vector<std::string> Texts(const ParameterValues& values) {
  std::vector<std::string> texts;
  for (const ParameterValue& value : values)
    texts.push_back(std::string(value.parameter->name) + " " + ValueText(value));
  return texts;
}

Result<ParameterValues> Registers(const std::vector<change_t>& changes) {
  return FromRegisters(ParameterFamily().parameters, changes);
}

change_t Read(const std::string& key, const std::string& after) { return {key, "", after}; }

TEST(FromRegisters, PutsBlocksTogetherByTheirAddresses) {
  const auto values = Registers({Read("registers 0-1", "04E20005"), Read("registers 4-6", "FFFF0BB80000")});
  ASSERT_TRUE(values);
  EXPECT_THAT(Texts(*values), ElementsAre("power_limit 125.0 W", "start_time 0.5 s", "shock_limit 30.00 m/s2"));
}

TEST(FromRegisters, ZeroSwitchesALimitOff) {
  EXPECT_THAT(Texts(Registers({Read("registers 0-5", "000000010000000000000000")}).value_or(ParameterValues())),
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
      {Read("registers 0-1", "04E20005"), "did not report shock_limit"}};
  for (const auto& [change, text] : cases) {
    const auto values = Registers({change});
    ASSERT_FALSE(values) << change.key;
    EXPECT_THAT(values.error().text, HasSubstr(text)) << change.key;
  }
}

TEST(FromWords, AreInTheOrderOfTheFamily) {
  const std::vector<std::string> words = {"shock_limit=30", "power_limit=125.0"};
  EXPECT_THAT(Texts(FromWords(ParameterFamily().parameters, words).value_or(ParameterValues())),
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
  for (const auto& [word, text] : cases) {
    const auto values = FromWords(ParameterFamily().parameters, std::vector{word});
    ASSERT_FALSE(values) << word;
    EXPECT_THAT(values.error().text, HasSubstr(text)) << word;
  }
  const std::vector<std::string> twice = {"start_time=1", "start_time=2"};
  const auto values = FromWords(ParameterFamily().parameters, twice);
  ASSERT_FALSE(values);
  EXPECT_THAT(values.error().text, HasSubstr("given twice"));
}

const Parameters kAll = ParameterFamily().parameters;

ParameterValues Present() { return {{kAll.data(), 1'000}, {&kAll[1], 5}, {&kAll[2], 3'000}}; }

TEST(ParameterDiff, HoldsOnlyWhatDiffers) {
  const ParameterChanges changes = ParameterDiff(Present(), {{kAll.data(), 1'250}, {&kAll[1], 5}, {&kAll[2], 0}});
  ASSERT_THAT(changes, SizeIs(2));
  EXPECT_EQ(ToText(changes),
            "  power_limit     100.0 -> 125.0 W\n"
            "  shock_limit     30.00 -> 0.00 m/s2 (off)\n");
  EXPECT_EQ(ToJson(changes).dump(), R"([{"name":"power_limit","unit":"W","before":100.0,"after":125.0},)"
                                    R"({"name":"shock_limit","unit":"m/s2","before":30.0,"after":0.0}])");
}

TEST(ParameterDiff, EqualValuesAreNoChange) {
  EXPECT_THAT(ParameterDiff(Present(), Present()), IsEmpty());
  EXPECT_THAT(ParameterDiff(Present(), {}), IsEmpty());
  EXPECT_EQ(WriteText("gm3", {}, {}), "gm3: nothing to write\n");
  EXPECT_EQ(WriteJson("gm3", {}, {}).dump(),
            R"({"outcome":"succeeded","device":"gm3","changes":[],"commands":[]})");
}

// A command holds 16 arguments (messages.md).
TEST(WriteRequests, AreAsManyAsSixteenArgumentsEachNeed) {
  CommandOptions options;
  options.device = "gm3";
  options.reason = "as at the trial";
  const auto requests = WriteRequests(options, ParameterChanges(33, {kAll.data(), 1'000, 1'250}));
  ASSERT_THAT(requests, SizeIs(3));
  EXPECT_THAT(requests[0].arguments, SizeIs(16));
  EXPECT_THAT(requests[1].arguments, SizeIs(16));
  EXPECT_THAT(requests[2].arguments, ElementsAre(Pair("power_limit", "125.0")));
  EXPECT_EQ(requests[2].device, "gm3");
  EXPECT_EQ(requests[2].operation, "write_parameters");
  EXPECT_EQ(requests[2].reason, "as at the trial");
  EXPECT_THAT(WriteRequests(options, {}), IsEmpty());
}

TEST(WriteText, TellsTheCommandThatFailedAndThoseBefore) {
  CommandResult done;
  done.answered = true;
  done.status.is_final = 1;
  done.status.verified = 1;
  done.status.state = command_status_t::STATE_SUCCEEDED;
  CommandResult failed = done;
  failed.status.state = command_status_t::STATE_FAILED;
  failed.status.text = "the unit refused a write";
  const ParameterChanges changes = {{kAll.data(), 1'000, 1'250}};
  EXPECT_EQ(WriteText("gm3", changes, {done}), "gm3: 1 parameters written and read back\n");
  EXPECT_THAT(WriteText("gm3", changes, {done, failed}), HasSubstr("the unit refused a write"));
  EXPECT_THAT(WriteText("gm3", changes, {done, failed}), HasSubstr("before it 1 commands were carried out"));
  EXPECT_EQ(WriteJson("gm3", changes, {done, failed})["outcome"], "failed");
}

TEST(ParameterList, ShowsPresentValuesWhereTheyAreKnown) {
  const Parameters parameters = ParameterFamily().parameters;
  const ParameterValues values =
      FromWords(parameters, std::vector<std::string>{"power_limit=125.0"}).value_or(ParameterValues());
  ASSERT_FALSE(values.empty());
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

constexpr const char* kByHand =
    "# as at the trial run\n"
    "family: made_up\n"
    "device: gm3\n"
    "parameters:\n"
    "  shock_limit: 30\n"
    "  power_limit: 125.0 W\n";

std::string ErrorsOf(const std::string& text) {
  ConfigErrors errors("p.yaml");
  static_cast<void>(ParseParameterFile(ParameterFamily(), text, errors));
  return errors.Text();
}

TEST(ParameterFile, AFileByHandAndItsExport) {
  ConfigErrors errors("p.yaml");
  const ParameterValues values = ParseParameterFile(ParameterFamily(), kByHand, errors);
  ASSERT_EQ(errors.Text(), "");
  ASSERT_THAT(values, SizeIs(2));
  EXPECT_EQ(values[0].parameter->name, "power_limit");
  EXPECT_EQ(values[0].raw, 1'250);
  EXPECT_EQ(values[1].raw, 3'000);

  const std::string exported = ParameterFileText(ParameterFamily(), "gm3", values);
  EXPECT_EQ(exported,
            "# axlecast param import DEVICE FILE writes what differs.\n"
            "family: made_up\n"
            "device: gm3\n"
            "parameters:\n"
            "  power_limit: 125.0  # 0.0 to 1000.0 W, 0 switches it off\n"
            "  shock_limit: 30.00  # 0.00 to 150.00 m/s2, 0 switches it off\n");
  const ParameterValues again = ParseParameterFile(ParameterFamily(), exported, errors);
  ASSERT_EQ(errors.Text(), "");
  ASSERT_THAT(again, SizeIs(2));
  EXPECT_EQ(again[0].raw, 1'250);
  EXPECT_EQ(again[1].raw, 3'000);
}

TEST(ParameterFile, EachMistakeHasItsLineAndWhatWouldBeRight) {
  const std::string head = "family: made_up\nparameters:\n";
  EXPECT_THAT(ErrorsOf(head + "  power_limit: 5000\n"),
              HasSubstr("p.yaml:3:16: parameters.power_limit: power_limit "
                        "must be 0.0 to 1000.0 W"));
  EXPECT_THAT(ErrorsOf(head + "  power_limt: 5\n"), HasSubstr("p.yaml:3:3: parameters: unknown key 'power_limt'; "
                                                              "did you mean 'power_limit'?"));
  EXPECT_THAT(ErrorsOf(head + "  power_limit: 1.25\n"), HasSubstr("steps of 0.1 W"));
  EXPECT_THAT(ErrorsOf(head + "  start_time: soon\n"), HasSubstr("start_time must be a number, 0.1 to 5.0 s"));
  EXPECT_THAT(ErrorsOf(head + "  start_time:\n"), HasSubstr("p.yaml:3:"));
  EXPECT_THAT(ErrorsOf(head + "  start_time: [1]\n"), HasSubstr("a list is given where"));
  EXPECT_THAT(ErrorsOf(head + "  start_time: 1\n  start_time: 2\n"),
              AllOf(HasSubstr("p.yaml:4:"), HasSubstr("twice")));
  EXPECT_THAT(ErrorsOf("family: other\nparameters: {start_time: 1}\n"),
              HasSubstr("p.yaml:1:9: family: 'other' is not the device's family 'made_up'"));
  EXPECT_THAT(ErrorsOf("parameters: {start_time: 1}\n"), HasSubstr("family: is missing"));
  EXPECT_THAT(ErrorsOf("family: made_up\n"), HasSubstr("parameters: is missing"));
  EXPECT_THAT(ErrorsOf("family: made_up\nparameters: {}\n"), HasSubstr("p.yaml:2:13: parameters: holds none"));
  EXPECT_THAT(ErrorsOf("family: made_up\nmotor: gm3\nparameters: {start_time: 1}\n"),
              HasSubstr("p.yaml:2:1: unknown key 'motor'"));
  EXPECT_THAT(ErrorsOf("\n"), HasSubstr("the file is empty"));
  EXPECT_THAT(ErrorsOf("family: [\n"), HasSubstr("not YAML"));
  EXPECT_THAT(ErrorsOf("just text\n"), HasSubstr("where a mapping"));
}

TEST(ParameterFile, AllMistakesAreToldAtOnce) {
  ConfigErrors errors("p.yaml");
  static_cast<void>(ParseParameterFile(
      ParameterFamily(), "family: made_up\nparameters: {power_limit: -1, start_time: 99, bogus: 1}\n", errors));
  EXPECT_THAT(errors.list(), SizeIs(3));
}

}  // namespace

}  // namespace axlecast
