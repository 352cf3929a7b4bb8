#include "tools/axlecast/common/subcommands.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <fstream>
#include <string>
#include <vector>

#include "tests/support/temporary_folder.h"
#include "tools/axlecast/common/terminal.h"

namespace axlecast {
namespace {

using ::testing::HasSubstr;

constexpr const char* kMachine = R"(machine: m
buses:
  rs485-0:
    family: tformat
    simulate: true
    devices:
      axis1: {model: ts5669n127}
  rs485-1:
    family: tformat
    simulate: true
    devices:
      axis2: {model: ts5669n127}
)";

class SimulateCommand : public ::testing::Test {
 protected:
  SimulateCommand() { std::ofstream(file_) << kMachine; }

  // Returns the exit code. Standard error is then in errors_.
  int Run(std::vector<std::string> words) {
    CLI::App app("test", "axlecast");
    int exit_code = kExitDone;
    AddSimulateCommand(app, exit_code);
    words.insert(words.begin(), {"simulate", file_});
    std::reverse(words.begin(), words.end());  // the order of CLI::App::parse
    testing::internal::CaptureStderr();
    try {
      app.parse(words);
    } catch (const CLI::ParseError& error) {
      exit_code = error.get_exit_code() == 0 ? kExitDone : kExitUsage;
    }
    errors_ = testing::internal::GetCapturedStderr();
    return exit_code;
  }

  const TemporaryFolder folder_;
  void AddBusWithAnError() {
    std::ofstream(file_, std::ios::app) << "  rs485-2: {family: tfromat, devices: {axis3: {}}}\n";
  }

  const std::string file_ = folder_.path() + "/machine.yaml";
  std::string errors_;
};

TEST_F(SimulateCommand, AnInterfaceStandsForOneBus) {
  EXPECT_EQ(Run({"--on", "can1"}), kExitUsage);
  EXPECT_THAT(errors_, HasSubstr("name it with --bus"));
}

TEST_F(SimulateCommand, OnlyACanBusStandsOnAnInterface) {
  EXPECT_EQ(Run({"--bus", "rs485-1", "--on", "can1"}), kExitUsage);
  EXPECT_THAT(errors_, HasSubstr("bus rs485-1 is no CAN bus"));
}

TEST_F(SimulateCommand, AnInterfaceIsForARunOnly) {
  for (const std::vector<std::string>& other : std::vector<std::vector<std::string>>{
           {"--show"}, {"--plug"}, {"--unplug"}, {"--set", "axis1.speed_rpm=3"}}) {
    std::vector<std::string> words = {"--bus", "rs485-0", "--on", "can1"};
    words.insert(words.end(), other.begin(), other.end());
    EXPECT_EQ(Run(words), kExitUsage) << other[0];
  }
}

// As its driver: the file of a machine with 300 buses is read by 300 simulators.
TEST_F(SimulateCommand, ARunOfOneBusReadsOnlyThePartOfThisBus) {
  AddBusWithAnError();
  EXPECT_EQ(Run({"--bus", "rs485-1", "--on", "can1"}), kExitUsage);
  EXPECT_THAT(errors_, HasSubstr("bus rs485-1 is no CAN bus"));
}

TEST_F(SimulateCommand, EveryOtherUseReadsTheWholeFile) {
  AddBusWithAnError();
  for (const std::vector<std::string>& words :
       std::vector<std::vector<std::string>>{{"--bus", "rs485-2"},
                                             {"--bus", "rs485-0", "--bus", "rs485-1"},
                                             {"--bus", "rs485-1", "--show"},
                                             {"--bus", "rs485-1", "--plug"}}) {
    EXPECT_EQ(Run(words), kExitBad) << words.back();
    EXPECT_THAT(errors_, HasSubstr("'tfromat' is not one of")) << words.back();
  }
}

TEST_F(SimulateCommand, AnUnknownBusIsAMistakeOfTheCommandLine) {
  EXPECT_EQ(Run({"--bus", "rs485-9"}), kExitUsage);
  EXPECT_THAT(errors_, HasSubstr("no bus 'rs485-9'"));
}

TEST_F(SimulateCommand, HelpIsNoError) { EXPECT_EQ(Run({"--help"}), kExitDone); }

}  // namespace
}  // namespace axlecast
