#include "core/config/service_config.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <cstdlib>

#include "core/config/load.h"

namespace axlecast {
namespace {

using ::testing::HasSubstr;
using ::testing::IsEmpty;

constexpr MonoNs kDay = 86'400 * kSecond;

// The recorder's keys begin in line 3.
std::optional<MachineConfig> Parse(const std::string& recorder, ConfigErrors& errors) {
  return ParseConfig("machine: press3\nrecorder:" + recorder +
                         "\nbuses:\n  b0: {family: point, simulate: true, devices: {axis1: {}}}\n",
                     errors);
}

RecorderConfig Recorder(const std::string& keys) {
  ConfigErrors errors("m.yaml");
  const auto machine = Parse('\n' + keys, errors);
  EXPECT_EQ(errors.Text(), "");
  return machine ? machine->recorder : RecorderConfig{};
}

std::string Mistake(const std::string& recorder) {
  ConfigErrors errors("m.yaml");
  EXPECT_FALSE(Parse(recorder, errors));
  return errors.Text();
}

TEST(LoadRecorder, ReadsEveryKey) {
  const RecorderConfig recorder = Recorder(
      "  directory: /var/log/axlecast\n"
      "  logs:\n"
      "    events: {channels: ^POSITION, invert: true, keep: 4y, fsync_ms: 0}\n"
      "    positions: {channels: ^POSITION, split_size: 1GB, split_time: 6h, quota: 20GB, keep: 2w, compress: "
      "true, buffer: "
      "128MB}\n"
      "    faults: {trigger: 'ALARM/.* battery', pre_trigger: 30s, post_trigger: 1m}");
  EXPECT_EQ(recorder.directory, "/var/log/axlecast");
  ASSERT_EQ(recorder.logs.size(), 3U);
  const LogConfig& events = recorder.logs[0];
  EXPECT_EQ(events.name, "events");
  EXPECT_EQ(events.channels, "^POSITION");
  EXPECT_TRUE(events.invert);
  EXPECT_EQ(events.keep, 1'461 * kDay);
  EXPECT_EQ(events.sync, 0);
  EXPECT_EQ(events.quota_bytes, 0);
  EXPECT_FALSE(events.compress);
  const LogConfig& positions = recorder.logs[1];
  EXPECT_FALSE(positions.invert);
  EXPECT_EQ(positions.split_bytes, 1 << 30);
  EXPECT_EQ(positions.split_time, 6 * 3'600 * kSecond);
  EXPECT_EQ(positions.quota_bytes, std::int64_t{20} << 30);
  EXPECT_EQ(positions.keep, 14 * kDay);
  EXPECT_EQ(positions.sync, 100 * kMillisecond);
  EXPECT_TRUE(positions.compress);
  EXPECT_EQ(positions.buffer_bytes, 128 << 20);
  const LogConfig& faults = recorder.logs[2];
  EXPECT_EQ(faults.trigger, "ALARM/.* battery");
  EXPECT_EQ(faults.pre_trigger, 30 * kSecond);
  EXPECT_EQ(faults.post_trigger, 60 * kSecond);
}

TEST(LoadRecorder, WithoutTheSectionThereIsNoLog) {
  ConfigErrors errors("m.yaml");
  const auto machine =
      ParseConfig("machine: a\nbuses:\n  b0: {family: point, simulate: true, devices: {axis1: {}}}\n", errors);
  ASSERT_TRUE(machine);
  EXPECT_THAT(machine->recorder.logs, IsEmpty());
}

TEST(LogDirectory, IsTheFilesElseThatOfSystemdElseTheUsers) {
  MachineConfig machine;
  machine.machine = "press3";
  machine.recorder.directory = "/data";
  EXPECT_EQ(LogDirectory(machine), "/data");
  machine.recorder.directory.clear();
  setenv("LOGS_DIRECTORY", "/var/log/axlecast", 1);
  EXPECT_EQ(LogDirectory(machine), "/var/log/axlecast/press3");
  unsetenv("LOGS_DIRECTORY");
  EXPECT_THAT(LogDirectory(machine), ::testing::EndsWith("/press3/log"));
}

TEST(LoadRecorder, NamesPlaceValueAndWhatIsRight) {
  const struct {
    const char* recorder;
    const char* message;
  } mistakes[] = {
      {"", "m.yaml:2:1: recorder.logs: is missing or empty: name at least one log"},
      {" x", "m.yaml:2:11: recorder: 'x' is given where a mapping"},
      {"\n  directory: logs\n  logs: {a: {}}",
       "m.yaml:3:14: recorder.directory: 'logs' is no absolute path, e.g. /var/log/axlecast"},
      {"\n  logs: {Events: {}}", "m.yaml:3:10: recorder.logs.Events: 'Events' is no name"},
      {"\n  logs: {a: {keap: 1d}}", "m.yaml:3:14: recorder.logs.a: unknown key 'keap'; did you mean 'keep'?"},
      {"\n  logs: {a: {keep: 14}}", "m.yaml:3:20: recorder.logs.a.keep: '14' is not a time: 90s, 15m, 1h, 14d"},
      {"\n  logs: {a: {keep: [1d]}}",
       "m.yaml:3:20: recorder.logs.a.keep: a list is given where a time is expected"},
      {"\n  logs: {a: {keep: 1s}}", "m.yaml:3:20: recorder.logs.a.keep: is at least 1m"},
      {"\n  logs: {a: {quota: 20}}", "recorder.logs.a.quota: '20' is not a size: 512kB, 100MB, 20GB or 1TB"},
      {"\n  logs: {a: {quota: 1MB}}", "recorder.logs.a.quota: is at least 2MB"},
      {"\n  logs: {a: {quota: 4MB, split_size: 3MB}}", "3:38: recorder.logs.a.split_size: is at most half"},
      {"\n  logs: {a: {split_size: 10kB}}", "recorder.logs.a.split_size: is at least 1MB"},
      {"\n  logs: {a: {split_time: 2d, keep: 1d}}", "recorder.logs.a.split_time: is at most as long as keep"},
      {"\n  logs: {a: {buffer: 1kB}}", "recorder.logs.a.buffer: is at least 16kB"},
      {"\n  logs: {a: {channels: 'a('}}", "3:24: recorder.logs.a.channels: 'a(' is no regular expression"},
      {"\n  logs: {a: {invert: true}}", "recorder.logs.a.invert: needs channels"},
      {"\n  logs: {a: {trigger: x}}", "recorder.logs.a.trigger: needs a pre_trigger beside it: 30s"},
      {"\n  logs: {a: {pre_trigger: 30s}}", "recorder.logs.a.pre_trigger: needs a trigger beside it"},
      {"\n  logs: {a: {fsync_ms: -1}}", "recorder.logs.a.fsync_ms: '-1' is not within 0 to 3600000 ms"},
      {"\n  logs: {a: {}, a: {}}", "key 'a' is given twice here"},
  };
  for (const auto& mistake : mistakes) {
    EXPECT_THAT(Mistake(mistake.recorder), HasSubstr(mistake.message)) << mistake.recorder;
  }
}

TEST(LoadRecorder, RefusesMoreLogsThanAMachineCanHear) {
  std::string logs;
  for (int i = 0; i < 17; ++i) logs += "\n    log" + std::to_string(i) + ": {}";
  EXPECT_THAT(Mistake("\n  logs:" + logs), HasSubstr("m.yaml:4:5: recorder.logs: 17 logs: at most 16"));
}

TEST(LogConfig, IsCutSoThatItCanBeDeleted) {
  LogConfig log;
  EXPECT_EQ(SplitBytes(log), 0);
  EXPECT_EQ(SplitTime(log), 0);
  log.quota_bytes = 800 << 20;
  EXPECT_EQ(SplitBytes(log), 100 << 20);
  log.keep = 4 * kDay;
  EXPECT_EQ(SplitTime(log), kDay / 2);
  log.keep = 1'000 * kDay;
  EXPECT_EQ(SplitTime(log), kDay) << "years go by the day";
  log.split_time = 7 * kDay;
  EXPECT_EQ(SplitTime(log), 7 * kDay);
}

}  // namespace

}  // namespace axlecast
