#include "tools/axlecast/record_options.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <CLI/CLI.hpp>
#include <string>
#include <vector>

namespace axlecast {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;

RecordPlan Plan(std::vector<std::string> words, const std::optional<MachineConfig>& machine = std::nullopt) {
  CLI::App app;
  RecordOptions options;
  options.AddTo(app);
  std::reverse(words.begin(), words.end());  // CLI11 takes them so
  app.parse(words);
  return MakeRecordPlan(options, machine);
}

TEST(MakeRecordPlan, RecordsBothPortsIntoAFolderByDefault) {
  const RecordPlan plan = Plan({});
  EXPECT_EQ(plan.problem, "");
  EXPECT_THAT(plan.settings.urls, ElementsAre(HasSubstr(":7667"), HasSubstr(":7668")));
  EXPECT_EQ(plan.settings.writer.folder, ".");
  EXPECT_EQ(plan.settings.writer.file, "");
  EXPECT_EQ(plan.settings.writer.name, "axlecast");
  EXPECT_EQ(plan.settings.writer.sync_interval, 100 * kMillisecond);
  EXPECT_FALSE(plan.settings.recorder.pre_trigger);
}

TEST(MakeRecordPlan, TakesTheMachinesFile) {
  MachineConfig machine;
  machine.machine = "press3";
  machine.text = "machine: press3\n";
  machine.lcm.prefix = "cell1/";
  const RecordPlan plan = Plan({}, machine);
  EXPECT_EQ(plan.settings.recorder.identity.name, "press3");
  EXPECT_EQ(plan.settings.recorder.identity.machine, "machine: press3\n");
  EXPECT_EQ(plan.prefix, "cell1/");
  EXPECT_EQ(Plan({"--name", "other"}, machine).settings.writer.name, "other");
}

TEST(MakeRecordPlan, UnderstandsSizesAndTimes) {
  const RecordPlan plan =
      Plan({"a.lcm", "--split-size", "100MB", "--split-time", "15m", "--fsync", "0", "--url",
            "tcpq://localhost:7700", "--trigger", "x", "--pre-trigger", "1.5", "--buffer", "1GB"});
  EXPECT_EQ(plan.problem, "");
  EXPECT_EQ(plan.settings.recorder.split_bytes, 100U << 20);
  EXPECT_EQ(plan.settings.recorder.split_time, 900 * kSecond);
  EXPECT_EQ(plan.settings.writer.sync_interval, 0);
  EXPECT_EQ(plan.settings.writer.file, "a.lcm");
  EXPECT_THAT(plan.settings.urls, ElementsAre("tcpq://localhost:7700"));
  EXPECT_EQ(plan.settings.recorder.pre_trigger->before, 1'500 * kMillisecond);
  EXPECT_EQ(plan.settings.recorder.pre_trigger->after, 10 * kSecond);
  EXPECT_EQ(plan.settings.queue_bytes, std::size_t{1} << 30);
}

TEST(MakeRecordPlan, AQuotaSplitsByItself) {
  EXPECT_EQ(Plan({"--quota", "800MB"}).settings.recorder.split_bytes, 100U << 20);
  EXPECT_EQ(Plan({"--quota", "800MB"}).settings.writer.retention.quota_bytes, 800 << 20);
}

TEST(MakeRecordPlan, RefusesWhatContradictsItself) {
  EXPECT_THAT(Plan({"--append"}).problem, HasSubstr("needs the file"));
  EXPECT_THAT(Plan({"/tmp", "--append"}).problem, HasSubstr("needs the file"));
  EXPECT_THAT(Plan({"a.lcm", "--quota", "1GB"}).problem, HasSubstr("give a folder"));
  EXPECT_THAT(Plan({"--quota", "1GB", "--split-size", "600MB"}).problem, HasSubstr("half of --quota"));
  EXPECT_THAT(Plan({"--split-size", "1kB"}).problem, HasSubstr("at least"));
  EXPECT_THAT(Plan({"--trigger", "x"}).problem, HasSubstr("--pre-trigger"));
  EXPECT_THAT(Plan({"--pre-trigger", "5"}).problem, HasSubstr("--trigger"));
  EXPECT_THAT(Plan({"a.lcm", "--append", "--trigger", "x", "--pre-trigger", "5"}).problem, HasSubstr("exclude"));
  EXPECT_THAT(Plan({"--channel", "a("}).problem, HasSubstr("no regular expression"));
  EXPECT_THAT(Plan({"--name", "../x"}).problem, HasSubstr("no name"));
}

}  // namespace
}  // namespace axlecast
