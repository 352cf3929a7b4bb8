#include <gtest/gtest.h>
#include <sys/stat.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <cstdio>
#include <cstdlib>
#include <fstream>
#include <string>
#include <vector>

#include "core/command/keys.h"
#include "tests/support/temporary_folder.h"
#include "tools/axlecast/common/subcommands.h"
#include "tools/axlecast/common/terminal.h"

namespace axlecast {
namespace {

constexpr const char* kMachine = R"(machine: m
buses:
  rs485-0:
    family: tformat
    link: {port: /dev/null, baud: 2500000}
    devices:
      axis1: {model: ts5669n127}
)";

class Commands : public ::testing::Test {
 protected:
  Commands() {
    file_ = directory_ + "/machine.yaml";
    std::ofstream(file_) << kMachine;
    unsetenv("AXLECAST_CONFIG");
    unsetenv("DISPLAY");
    // Nobody answers questions.
    EXPECT_NE(std::freopen("/dev/null", "r", stdin), nullptr);
  }

  // The exit code of a command line, as main has it.
  static int Run(std::vector<std::string> words) {
    CLI::App app("test", "axlecast");
    int exit_code = kExitDone;
    AddUpCommand(app, exit_code);
    AddWatchCommand(app, exit_code);
    AddStatusCommand(app, exit_code);
    AddInfoCommand(app, exit_code);
    AddDoCommands(app, exit_code);
    AddHomeCommand(app, exit_code);
    AddDatumUndo(*app.add_subcommand("datum"), exit_code);
    AddOffsetCommand(app, exit_code);
    AddPermitCommand(app, exit_code);
    AddDriverCommand(app, exit_code);
    AddSpyCommand(app, exit_code);
    AddShellCommand(app, exit_code);
    std::reverse(words.begin(), words.end());  // as CLI::App::parse requires
    try {
      app.parse(words);
    } catch (const CLI::ParseError& error) {
      return error.get_exit_code() == 0 ? kExitDone : kExitUsage;
    }
    return exit_code;
  }

  const TemporaryFolder folder_;
  const std::string directory_ = folder_.path();
  std::string file_;
};

TEST_F(Commands, WrongUsage) {
  EXPECT_EQ(Run({"watch", "--channel", "("}), kExitUsage);
  EXPECT_EQ(Run({"watch", "--count", "0"}), kExitUsage);
  EXPECT_EQ(Run({"up", file_, "--seconds", "-1"}), kExitUsage);
  EXPECT_EQ(Run({"status", "--nonsense"}), kExitUsage);
  EXPECT_EQ(Run({"eeprom"}), kExitUsage);
  EXPECT_EQ(Run({"outcome", "123", "--config", file_}), kExitUsage);
  EXPECT_EQ(Run({"do", "axis1", "clear_errors", "--valid-ms", "3600001"}), kExitUsage);
  EXPECT_EQ(Run({"do", "axis1", "clear_errors", "--commit", "12", "--config", file_}), kExitUsage);
  EXPECT_EQ(Run({"zero", "axis1", "--prepare", "--commit", std::string(32, '0'), "--config", file_}), kExitUsage);
  EXPECT_EQ(Run({"home", "axis1", "--config", file_}), kExitUsage);
  EXPECT_EQ(Run({"permit", "axis1", "--config", file_}), kExitUsage);
  EXPECT_EQ(Run({"permit", "axis1", "zero_single_turn", "--for", "-1s", "--config", file_}), kExitUsage);
}

TEST_F(Commands, AMachinesFileThatIsNotThereOrBad) {
  EXPECT_EQ(Run({"status", directory_ + "/none.yaml"}), kExitBad);
  std::ofstream(file_) << "machine: m\nbusses: {}\n";
  for (const char* command : {"up", "status", "watch", "spy"})
    EXPECT_EQ(Run({command, file_}), kExitBad) << command;
}

TEST_F(Commands, NamesThatDoNotExist) {
  EXPECT_EQ(Run({"info", file_, "axis2"}), kExitUsage);
  EXPECT_EQ(Run({"driver", "rs485-1", "--config", file_}), kExitUsage);
  EXPECT_EQ(Run({"do", "axis2", "clear_errors", "--config", file_}), kExitUsage);
  EXPECT_EQ(Run({"do", "axis1", "fly", "--config", file_}), kExitUsage);
  EXPECT_EQ(Run({"do", "axis1", "eeprom_read", "adress=0", "--config", file_}), kExitUsage);
  EXPECT_EQ(Run({"do", "axis1", "--config", file_}), kExitUsage);
  EXPECT_EQ(Run({"home", "axis2", "--value", "1", "--yes", "--config", file_}), kExitUsage);
  EXPECT_EQ(Run({"offset", "capture", "axis2", "--config", file_}), kExitUsage);
  EXPECT_EQ(Run({"permit", "axis1", "fly", "--for", "1ms", "--config", file_}), kExitUsage);
}

TEST_F(Commands, DestructiveOnesDoNothingWithoutAnAnswer) {
  EXPECT_EQ(Run({"zero", "axis1", "--config", file_}), kExitUsage);
  EXPECT_EQ(Run({"reset-turns", "axis1", "--config", file_}), kExitUsage);
  EXPECT_EQ(Run({"eeprom", "write", "axis1", "0", "A1", "--config", file_}), kExitUsage);
}

// The file allows nothing unsigned and has no key of role control.
TEST_F(Commands, PermitsNeedAKeyOfRoleControl) {
  unsetenv("AXLECAST_KEY");
  EXPECT_EQ(Run({"permit", "axis1", "zero_single_turn", "--for", "1ms", "--config", file_}), kExitBad);
  const SigningKey key = SigningKey::Generate();
  const std::string key_file = directory_ + "/key";
  std::ofstream(key_file) << key.FileText();
  ASSERT_EQ(chmod(key_file.c_str(), 0600), 0);
  const auto permit = [&] {
    return Run({"permit", "axis1", "zero_single_turn", "--for", "1ms", "--key", key_file, "--config", file_});
  };
  EXPECT_EQ(permit(), kExitBad);
  std::ofstream(file_) << kMachine << "bridge: {keys: {op: {public: " << KeyText(key.public_key())
                       << ", role: operator}}}\n";
  EXPECT_EQ(permit(), kExitBad);
}

TEST_F(Commands, ListsAndPrintsWithoutARunningMachine) {
  EXPECT_EQ(Run({"do", "axis1", "--list", "--config", file_}), kExitDone);
  setenv("AXLECAST_CONFIG", file_.c_str(), 1);
  EXPECT_EQ(Run({"do", "axis1", "--list"}), kExitDone);
}

TEST_F(Commands, HelpIsNoError) {
  for (const char* command :
       {"up", "watch", "status", "info", "do", "zero", "eeprom", "home", "permit", "driver", "spy"}) {
    EXPECT_EQ(Run({command, "--help"}), kExitDone) << command;
  }
}

}  // namespace
}  // namespace axlecast
