#include <gmock/gmock.h>
#include <CLI/CLI.hpp>
#include <string>
#include <vector>

#include "tools/axlecast/cli_tree.h"

namespace axlecast {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::Not;

class CliTreeTest : public ::testing::Test {
 protected:
  CliTreeTest() {
    CLI::App* read = app_.add_subcommand("read", "Reads bytes");
    read->footer("example: axlecast read axis1 72");
    read->add_option("DEVICE", text_, "The device")->required();
    read->add_option("--count,-n", count_, "Number of bytes")->check(CLI::Range(1, 64))->capture_default_str();
    read->add_option("--format", text_, "How")->check(CLI::IsMember({"hex", "text"}));
    read->add_option("--only", texts_, "Each of them")->type_name("NAME");
    CLI::Option* json = read->add_flag("--json", json_, "One JSON object");
    read->add_flag("--watch", json_, "Again and again")->excludes(json);
    app_.add_subcommand("hidden", "For nobody")->group("");
    AddCliTreeOption(app_);
  }

  [[nodiscard]] nlohmann::ordered_json Read() const { return CliTree(app_).at("commands").at(0); }
  [[nodiscard]] nlohmann::ordered_json Option(std::size_t index) const { return Read().at("options").at(index); }

  CLI::App app_{"Shaft positions", "axlecast"};

 private:
  std::string text_;
  std::vector<std::string> texts_;
  int count_ = 8;
  bool json_ = false;
};

TEST_F(CliTreeTest, TellsCommandsWithDescriptionAndFooterAndOmitsHiddenOnes) {
  const auto tree = CliTree(app_);
  EXPECT_EQ(tree.at("name"), "axlecast");
  EXPECT_EQ(tree.at("description"), "Shaft positions");
  EXPECT_EQ(tree.at("options").size(), 1U) << "--help, without --cli-tree";
  EXPECT_EQ(tree.at("commands").size(), 1U);
  EXPECT_EQ(Read().at("name"), "read");
  EXPECT_EQ(Read().at("footer"), "example: axlecast read axis1 72");
}

TEST_F(CliTreeTest, TellsAnArgument) {
  ASSERT_EQ(Read().at("arguments").size(), 1U);
  const auto argument = Read().at("arguments").at(0);
  EXPECT_THAT(argument.at("names").get<std::vector<std::string>>(), ElementsAre("DEVICE"));
  EXPECT_EQ(argument.at("required"), true);
  EXPECT_EQ(argument.at("most"), 1);
}

TEST_F(CliTreeTest, TellsAnOptionsNamesLimitsAndDefault) {
  const auto option = Option(1);
  EXPECT_THAT(option.at("names").get<std::vector<std::string>>(), ElementsAre("-n", "--count"));
  EXPECT_EQ(option.at("value"), "INT");
  EXPECT_EQ(option.at("limits"), "INT in [1 - 64]");
  EXPECT_EQ(option.at("default"), "8");
  EXPECT_FALSE(option.contains("required"));
}

TEST_F(CliTreeTest, TellsChoices) {
  EXPECT_THAT(Option(2).at("choices").get<std::vector<std::string>>(), ElementsAre("hex", "text"));
}

TEST_F(CliTreeTest, AnOptionThatTakesAnyNumberHasNoMost) {
  EXPECT_EQ(Option(3).at("value"), "NAME");
  EXPECT_FALSE(Option(3).contains("most"));
}

TEST_F(CliTreeTest, AFlagTakesNoValueAndNamesWhatItExcludes) {
  EXPECT_FALSE(Option(4).contains("value"));
  EXPECT_THAT(Option(5).at("excludes").get<std::vector<std::string>>(), ElementsAre("--json"));
}

TEST_F(CliTreeTest, TheHiddenOptionPrintsTheTreeAndEndsWell) {
  ::testing::internal::CaptureStdout();
  EXPECT_THROW(app_.parse("--cli-tree"), CLI::Success);
  EXPECT_EQ(nlohmann::ordered_json::parse(::testing::internal::GetCapturedStdout()), CliTree(app_));
}

class UnknownCommandTest : public ::testing::Test {
 protected:
  UnknownCommandTest() {
    app_.add_subcommand("status", "");
    CLI::App* param = app_.add_subcommand("param", "");
    param->add_subcommand("list", "")->add_option("DEVICE");
    param->add_subcommand("set", "");
    CLI::App* alarms = app_.add_subcommand("alarms", "");  // a command, and has commands
    alarms->add_option("CONFIG");
    alarms->add_subcommand("shelve", "");
  }
  [[nodiscard]] std::string Of(const std::vector<std::string>& words) const {
    return ErrorText(CheckCommands(app_, words));
  }

  CLI::App app_{"test", "axlecast"};
};

TEST_F(UnknownCommandTest, AMisspeltCommandHasASuggestion) {
  EXPECT_EQ(Of({"statsu"}),
            "axlecast: there is no command 'statsu'; did you mean 'status'?\nAll commands: axlecast --help");
  EXPECT_THAT(Of({"param", "lst", "gm3"}),
              HasSubstr("axlecast param: there is no command 'lst'; did you mean 'list'?"));
  EXPECT_THAT(Of({"--json", "pram"}), HasSubstr("did you mean 'param'?"));
  EXPECT_THAT(Of({"quux"}), Not(HasSubstr("did you mean")));
}

TEST_F(UnknownCommandTest, WhatIsOneOrAnArgumentIsLeftToTheParser) {
  EXPECT_EQ(Of({}), "");
  EXPECT_EQ(Of({"status", "statsu"}), "");
  EXPECT_EQ(Of({"param", "list", "lst"}), "");
  EXPECT_EQ(Of({"param"}), "");
  EXPECT_EQ(Of({"alarms", "machine.yaml"}), "");
  EXPECT_EQ(Of({"--version"}), "");
}

}  // namespace

}  // namespace axlecast
