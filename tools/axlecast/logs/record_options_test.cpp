#include "tools/axlecast/logs/record.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <CLI/CLI.hpp>
#include <string>
#include <vector>

namespace axlecast {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;

Result<RecordPlan> Make(std::vector<std::string> words, const std::optional<MachineConfig>& machine) {
  CLI::App app;
  RecordOptions options;
  options.AddTo(app);
  std::reverse(words.begin(), words.end());  // CLI11 takes them so
  app.parse(words);
  return MakeRecordPlan(options, machine);
}

RecordPlan Plan(const std::vector<std::string>& words, const std::optional<MachineConfig>& machine = std::nullopt) {
  return Make(words, machine).value();
}

std::string ErrorOf(const std::vector<std::string>& words,
                    const std::optional<MachineConfig>& machine = std::nullopt) {
  return Make(words, machine).error().text;
}

TEST(MakeRecordPlan, RecordsBothPortsIntoAFolderByDefault) {
  const RecordPlan plan = Plan({});
  EXPECT_THAT(plan.logs.at(0).urls, ElementsAre(HasSubstr(":7667"), HasSubstr(":7668")));
  EXPECT_EQ(plan.logs.at(0).writer.folder, ".");
  EXPECT_EQ(plan.logs.at(0).writer.file, "");
  EXPECT_EQ(plan.logs.at(0).writer.name, "axlecast");
  EXPECT_EQ(plan.logs.at(0).writer.sync_interval, 100 * kMillisecond);
  EXPECT_FALSE(plan.logs.at(0).recorder.pre_trigger);
}

TEST(MakeRecordPlan, TakesTheMachinesFile) {
  MachineConfig machine;
  machine.machine = "press3";
  machine.text = "machine: press3\n";
  machine.lcm.prefix = "cell1/";
  const RecordPlan plan = Plan({}, machine);
  EXPECT_EQ(plan.logs.at(0).recorder.identity.name, "press3");
  EXPECT_EQ(plan.logs.at(0).recorder.identity.machine, "machine: press3\n");
  EXPECT_EQ(plan.prefix, "cell1/");
  EXPECT_EQ(Plan({"--name", "other"}, machine).logs.at(0).writer.name, "other");
}

TEST(MakeRecordPlan, UnderstandsSizesAndTimes) {
  const RecordPlan plan =
      Plan({"a.lcm", "--split-size", "100MB", "--split-time", "15m", "--fsync", "0", "--url",
            "tcpq://localhost:7700", "--trigger", "x", "--pre-trigger", "1.5", "--buffer", "1GB"});
  EXPECT_EQ(plan.logs.at(0).recorder.split_bytes, 100U << 20);
  EXPECT_EQ(plan.logs.at(0).recorder.split_time, 900 * kSecond);
  EXPECT_EQ(plan.logs.at(0).writer.sync_interval, 0);
  EXPECT_EQ(plan.logs.at(0).writer.file, "a.lcm");
  EXPECT_THAT(plan.logs.at(0).urls, ElementsAre("tcpq://localhost:7700"));
  EXPECT_EQ(plan.logs.at(0).recorder.pre_trigger->before, 1'500 * kMillisecond);
  EXPECT_EQ(plan.logs.at(0).recorder.pre_trigger->after, 10 * kSecond);
  EXPECT_EQ(plan.logs.at(0).queue_bytes, std::size_t{1} << 30);
}

TEST(MakeRecordPlan, AQuotaSplitsByItself) {
  EXPECT_EQ(Plan({"--quota", "800MB"}).logs.at(0).recorder.split_bytes, 100U << 20);
  EXPECT_EQ(Plan({"--quota", "800MB"}).logs.at(0).writer.retention.quota_bytes, 800 << 20);
}

TEST(MakeRecordPlan, ATimeToKeepSplitsByItself) {
  const RecordingSettings log = Plan({"--keep", "2w"}).logs.at(0);
  EXPECT_EQ(log.recorder.split_time, 86'400 * kSecond);
  EXPECT_EQ(log.writer.retention.keep_us, std::int64_t{14} * 86'400 * 1'000'000);
}

class MachinesLogs : public ::testing::Test {
 protected:
  MachinesLogs() {
    machine_.machine = "press3";
    machine_.recorder.directory = "/data";
    LogConfig events;
    events.name = "events";
    events.channels = "^POSITION";
    events.invert = true;
    events.keep = 400 * 86'400 * kSecond;
    LogConfig faults;
    faults.name = "faults";
    faults.trigger = "x";
    faults.pre_trigger = 5 * kSecond;
    faults.sync = 0;
    faults.compress = true;
    machine_.recorder.logs = {events, faults};
  }
  MachineConfig machine_;
};

TEST_F(MachinesLogs, AreWrittenWhereNoFileIsNamed) {
  const RecordPlan plan = Plan({}, machine_);
  EXPECT_EQ(plan.folder, "/data");
  ASSERT_EQ(plan.logs.size(), 2U);
  const RecordingSettings& events = plan.logs[0];
  EXPECT_EQ(events.recorder.identity.name, "events");
  EXPECT_EQ(events.recorder.identity.channel, "^POSITION");
  EXPECT_EQ(events.writer.folder, "/data");
  EXPECT_EQ(events.writer.name, "press3-events");
  EXPECT_EQ(events.writer.retention.keep_us, std::int64_t{400} * 86'400 * 1'000'000);
  EXPECT_EQ(events.recorder.split_time, 86'400 * kSecond);
  EXPECT_THAT(events.urls, ElementsAre(HasSubstr(":7667"), HasSubstr(":7668")));
  EXPECT_EQ(plan.logs[1].writer.sync_interval, 0);
  EXPECT_TRUE(plan.logs[1].writer.compress);
  EXPECT_FALSE(events.writer.compress);
  EXPECT_FALSE(events.writer.retention.needs_shipping);
  EXPECT_EQ(plan.logs[1].recorder.pre_trigger->before, 5 * kSecond);
  EXPECT_EQ(Plan({"--json"}, machine_).logs.size(), 2U);
}

TEST_F(MachinesLogs, WaitForTheShipperIfThereIsOne) {
  EXPECT_FALSE(Plan({}, machine_).logs[0].writer.retention.needs_shipping);
  machine_.ship.database = "host=db1";
  const Retention retention = Plan({}, machine_).logs[0].writer.retention;
  EXPECT_TRUE(retention.needs_shipping);
  EXPECT_EQ(retention.reserve_percent, 5);
  EXPECT_FALSE(Plan({"."}, machine_).logs[0].writer.retention.needs_shipping)
      << "a recording by hand is not shipped";
}

TEST_F(MachinesLogs, AreNotThoseOfTheCommandLine) {
  const RecordPlan plan = Plan({".", "--channel", "x"}, machine_);
  EXPECT_EQ(plan.folder, "");
  EXPECT_EQ(plan.logs.at(0).writer.name, "press3");
  EXPECT_EQ(plan.logs.at(0).writer.retention.keep_us, 0);
  EXPECT_TRUE(Plan({".", "--compress"}, machine_).logs.at(0).writer.compress);
  EXPECT_EQ(Plan({"--url", "udpm://239.255.76.67:7700"}, machine_).folder, "");
  EXPECT_THAT(ErrorOf({"--channel", "x"}, machine_), HasSubstr("--channel needs a FILE"));
  EXPECT_THAT(ErrorOf({"--trigger", "x", "--json"}, machine_), HasSubstr("--trigger needs a FILE"));
}

TEST(MakeRecordPlan, RefusesWhatContradictsItself) {
  EXPECT_THAT(ErrorOf({"--append"}), HasSubstr("needs the FILE"));
  EXPECT_THAT(ErrorOf({"/tmp", "--append"}), HasSubstr("needs the FILE"));
  EXPECT_THAT(ErrorOf({"a.lcm", "--quota", "1GB"}), HasSubstr("give a folder"));
  EXPECT_THAT(ErrorOf({"--quota", "1GB", "--split-size", "600MB"}), HasSubstr("--split-size: is at most half"));
  EXPECT_THAT(ErrorOf({"a.lcm", "--keep", "1d"}), HasSubstr("give a folder"));
  EXPECT_THAT(ErrorOf({"a.lcm", "--compress"}), HasSubstr("--compress replaces only logs with generated names"));
  EXPECT_THAT(ErrorOf({"--url", "file:///tmp/a.lcm?mode=r"}), HasSubstr("axlecast replay"));
  EXPECT_THAT(ErrorOf({"--url", "memq://"}), HasSubstr("does not leave its process"));
  EXPECT_THAT(ErrorOf({"--split-size", "1kB"}), HasSubstr("at least"));
  EXPECT_THAT(ErrorOf({"--trigger", "x"}), HasSubstr("--trigger: needs a pre_trigger"));
  EXPECT_THAT(ErrorOf({"--pre-trigger", "5"}), HasSubstr("--pre-trigger: needs a trigger"));
  EXPECT_THAT(ErrorOf({"a.lcm", "--append", "--trigger", "x", "--pre-trigger", "5"}),
              HasSubstr("makes a log for each trigger"));
  EXPECT_THAT(ErrorOf({"--channel", "a("}), HasSubstr("no regular expression"));
  EXPECT_THAT(ErrorOf({"--name", "../x"}), HasSubstr("not a name"));
}

}  // namespace
}  // namespace axlecast
