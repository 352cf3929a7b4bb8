#include "tools/axlecast/unknown_command.h"

#include <gmock/gmock.h>

#include <CLI/CLI.hpp>

namespace axlecast {
namespace {

using ::testing::HasSubstr;
using ::testing::Not;

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
  [[nodiscard]] std::string Of(const std::vector<std::string>& words) const { return UnknownCommand(app_, words); }

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
