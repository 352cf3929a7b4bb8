#include "tools/recorder/log_writer.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <string>

#include "tests/support/fake_clock.h"
#include "tests/support/temporary_folder.h"
#include "tools/log/log_event.h"

namespace axlecast {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::UnorderedElementsAre;

constexpr std::int64_t kUtime = 1'795'244'405'000'000;  // 2026-11-21 07:00:05

std::vector<std::uint8_t> Record(std::int64_t number, const std::string& text = "x") {
  std::vector<std::uint8_t> record;
  AppendEvent(record, {number, kUtime, "A", {reinterpret_cast<const std::uint8_t*>(text.data()), text.size()}});
  return record;
}

class LogWriterTest : public ::testing::Test {
 protected:
  LogWriter& Make(const std::string& file, const Retention& retention = {}) {
    LogWriterSettings settings;
    settings.folder = folder_.path();
    settings.name = "m";
    settings.file = file.empty() ? "" : folder_.path() + '/' + file;
    settings.retention = retention;
    return writer_.emplace(std::move(settings), clock_);
  }
  [[nodiscard]] std::vector<std::string> Files() const {
    std::vector<std::string> files;
    for (const auto& entry : std::filesystem::directory_iterator(folder_.path())) {
      files.push_back(entry.path().filename().string());
    }
    std::sort(files.begin(), files.end());
    return files;
  }
  [[nodiscard]] std::size_t SizeOf(const std::string& file) const {
    return std::filesystem::file_size(folder_.path() + '/' + file);
  }

  TemporaryFolder folder_;
  FakeClock clock_;
  std::optional<LogWriter> writer_;
};

TEST_F(LogWriterTest, NamesLogsByTheirTime) {
  LogWriter& writer = Make("");
  for (int i = 0; i < 3; ++i) {
    writer.Begin(kUtime + i / 2 * 1'000'000);
    writer.Write(Record(0));
    writer.End();
  }
  EXPECT_EQ(writer.Finish(), 0);
  EXPECT_THAT(Files(),
              ElementsAre("m_20261121T070005Z.lcm", "m_20261121T070005Z_001.lcm", "m_20261121T070006Z.lcm"));
  for (const std::string& file : Files()) EXPECT_EQ(SizeOf(file), Record(0).size());
}

TEST_F(LogWriterTest, NeverUsesANameTwice) {
  LogWriter& writer = Make("");
  for (int i = 0; i < 3; ++i) {
    writer.Begin(kUtime);
    writer.Write(Record(0));
    writer.End();
    writer.Poll();
    std::filesystem::remove(folder_.path() + "/m_20261121T070005Z.lcm");
  }
  EXPECT_THAT(Files(), ElementsAre("m_20261121T070005Z_001.lcm", "m_20261121T070005Z_002.lcm"));
}

TEST_F(LogWriterTest, NumbersTheLogsOfAGivenName) {
  LogWriter& writer = Make("run7.log");
  for (int i = 0; i < 3; ++i) {
    writer.Begin(kUtime);
    writer.Write(Record(0));
    writer.End();
  }
  EXPECT_EQ(writer.Finish(), 0);
  EXPECT_THAT(Files(), ElementsAre("run7.log", "run7_001.log", "run7_002.log"));
}

TEST_F(LogWriterTest, WritesAtOnceAndSyncsInTime) {
  LogWriter& writer = Make("a.lcm");
  writer.Begin(kUtime);
  writer.Write(Record(0));
  EXPECT_TRUE(Files().empty());
  writer.Poll();
  EXPECT_EQ(SizeOf("a.lcm"), Record(0).size());
  EXPECT_EQ(writer.next_poll(), clock_.Now() + 100 * kMillisecond);
  clock_.Advance(100 * kMillisecond);
  writer.Poll();
  EXPECT_GT(writer.next_poll(), clock_.Now() + 100 * kMillisecond) << "all is on the disk";
  EXPECT_EQ(writer.status().file_bytes, static_cast<std::int64_t>(Record(0).size()));
  EXPECT_GT(writer.status().free_bytes, 0);
}

TEST_F(LogWriterTest, WritesLargeAmountsWithoutBeingAsked) {
  LogWriter& writer = Make("a.lcm");
  writer.Begin(kUtime);
  for (int i = 0; i < 30; ++i) writer.Write(Record(i, std::string(100'000, 'x')));
  EXPECT_GT(SizeOf("a.lcm"), 1'000'000U);
}

TEST_F(LogWriterTest, GoesOnBehindWhatIsWhole) {
  std::ofstream(folder_.path() + "/a.lcm") << "0123456789";
  LogWriter& writer = Make("a.lcm");
  writer.Append(4);
  writer.Begin(kUtime);
  writer.Write(Record(1));
  EXPECT_EQ(writer.Finish(), 0);
  EXPECT_EQ(SizeOf("a.lcm"), 4 + Record(1).size());
}

TEST_F(LogWriterTest, NeverReplacesAFile) {
  std::ofstream(folder_.path() + "/a.lcm") << "precious";
  LogWriter& writer = Make("a.lcm");
  writer.Begin(kUtime);
  writer.Write(Record(0));
  writer.Poll();
  EXPECT_TRUE(writer.blocked());
  EXPECT_THAT(writer.status().last_error, HasSubstr("--append"));
  EXPECT_EQ(SizeOf("a.lcm"), 8U);
}

TEST_F(LogWriterTest, KeepsWhatTheDiskDoesNotTakeAndTriesAgain) {
  LogWriter& writer = Make("later/a.lcm");
  writer.Begin(kUtime);
  writer.Write(Record(0));
  writer.Poll();
  EXPECT_TRUE(writer.blocked());
  EXPECT_EQ(writer.status().state, DiskState::kFailed);
  EXPECT_THAT(writer.status().last_error, HasSubstr("create the folder first"));
  std::filesystem::create_directory(folder_.path() + "/later");
  writer.Poll();
  EXPECT_TRUE(writer.blocked()) << "its time has not come";
  clock_.Advance(kSecond);
  writer.Poll();
  EXPECT_FALSE(writer.blocked());
  EXPECT_EQ(writer.status().state, DiskState::kGood);
  EXPECT_EQ(writer.Finish(), 0);
  EXPECT_EQ(SizeOf("later/a.lcm"), Record(0).size());
}

TEST_F(LogWriterTest, TellsWhatWasNeverWritten) {
  LogWriter& writer = Make("none/a.lcm");
  writer.Begin(kUtime);
  for (int i = 0; i < 3; ++i) writer.Write(Record(i));
  writer.Poll();
  EXPECT_EQ(writer.Finish(), 3);
}

TEST_F(LogWriterTest, DeletesTheOldestLogsBeyondTheQuota) {
  std::ofstream(folder_.path() + "/m_20201121T070005Z.lcm") << std::string(500, 'x');
  std::ofstream(folder_.path() + "/m_20211121T070005Z.lcm") << std::string(500, 'x');
  std::ofstream(folder_.path() + "/other_20201121T070005Z.lcm") << std::string(500, 'x');
  LogWriter& writer = Make("", {.quota_bytes = 600});
  writer.Begin(kUtime);
  writer.Write(Record(0));
  writer.Poll();
  EXPECT_THAT(Files(),
              ElementsAre("m_20211121T070005Z.lcm", "m_20261121T070005Z.lcm", "other_20201121T070005Z.lcm"));
}

TEST_F(LogWriterTest, LeavesAloneWhatAnotherRecorderWrites) {
  LogFile other;
  ASSERT_EQ(other.Create(folder_.path() + "/m_20201121T070005Z.lcm"), 0);
  const std::vector<std::uint8_t> content(500, 'x');
  Bytes bytes = content;
  ASSERT_EQ(other.Write(bytes), 0);
  LogWriter& writer = Make("", {.quota_bytes = 100});
  writer.Begin(kUtime);
  writer.Write(Record(0));
  writer.Poll();
  EXPECT_THAT(Files(), ElementsAre("m_20201121T070005Z.lcm", "m_20261121T070005Z.lcm"));
  ASSERT_EQ(other.Close(), 0);
  clock_.Advance(kSecond);
  writer.Poll();
  EXPECT_THAT(Files(), ElementsAre("m_20261121T070005Z.lcm"));
}

TEST_F(LogWriterTest, DoesNotGoOnWithWhatAnotherRecorderWrites) {
  LogFile other;
  ASSERT_EQ(other.Create(folder_.path() + "/a.lcm"), 0);
  LogWriter& writer = Make("a.lcm");
  writer.Append(0);
  writer.Begin(kUtime);
  writer.Write(Record(0));
  writer.Poll();
  EXPECT_TRUE(writer.blocked());
  EXPECT_THAT(writer.status().last_error, HasSubstr("another recorder writes it"));
  EXPECT_EQ(SizeOf("a.lcm"), 0U);
}

TEST_F(LogWriterTest, KnowsTheDisksRoomBeforeThereIsALog) {
  LogWriter& writer = Make("");
  writer.Poll();
  EXPECT_GT(writer.status().free_bytes, 0);
  EXPECT_THAT(Files(), IsEmpty());
}

TEST_F(LogWriterTest, DeletesLogsWhoseLastEventIsTooOld) {
  constexpr std::int64_t kHour = 3'600'000'000;
  const auto store = [this](int begun, int ended, const std::string& name = "m") {
    const std::int64_t now = clock_.UtcMicroseconds();
    std::string file = LogFileName(name, now - begun * kHour, 0);
    std::vector<std::uint8_t> log;
    AppendEvent(log, {0, now - begun * kHour, "A", {}});
    AppendEvent(log, {1, now - ended * kHour, "A", {}});
    std::ofstream(folder_.path() + '/' + file)
        .write(reinterpret_cast<const char*>(log.data()), static_cast<std::streamsize>(log.size()));
    return file;
  };
  store(40, 30);
  store(30, 25);
  const std::string mixed = store(25, 10);
  const std::string other = store(40, 30, "other");
  LogWriter& writer = Make("", {.keep_us = 24 * kHour});
  writer.Begin(clock_.UtcMicroseconds());
  std::vector<std::uint8_t> record;
  AppendEvent(record, {0, clock_.UtcMicroseconds(), "A", {}});
  writer.Write(record);
  writer.Poll();
  const std::string current = std::filesystem::path(writer.status().file).filename().string();
  EXPECT_THAT(Files(), UnorderedElementsAre(mixed, current, other));
  clock_.Advance(15 * 3'600 * kSecond);
  writer.Poll();
  EXPECT_THAT(Files(), UnorderedElementsAre(current, other));
  clock_.Advance(48 * 3'600 * kSecond);
  writer.Poll();
  EXPECT_THAT(Files(), UnorderedElementsAre(current, other)) << "it is being written";
  writer.End();
  writer.Poll();
  clock_.Advance(kSecond);
  writer.Poll();
  EXPECT_THAT(Files(), ElementsAre(other)) << "an episode that ended";
}

constexpr std::int64_t kSecondUs = 1'000'000;
constexpr std::int64_t kNow = 1'795'244'405 * kSecondUs;  // date -u -d @1795244405: 2026-11-21 07:00:05

TEST(LogFileName, IsNameAndUtcTime) {
  EXPECT_EQ(LogFileName("press3", kNow + 999'999, 0), "press3_20261121T070005Z.lcm");
  EXPECT_EQ(LogFileName("press3", kNow, 7), "press3_20261121T070005Z_007.lcm");
  EXPECT_EQ(LogFileName("press3", kNow, 1'234), "press3_20261121T070005Z_1234.lcm");
}

TEST(LogFileBegin, ReadsOnlyOwnNames) {
  EXPECT_EQ(LogFileBegin("press3", "press3_20261121T070005Z.lcm"), kNow);
  EXPECT_EQ(LogFileBegin("press3", "press3_20261121T070005Z_007.lcm"), kNow);
  for (const char* file :
       {"press3_20261121T070005Z.log", "press4_20261121T070005Z.lcm", "press3_20261121T070005Z_x.lcm", "press3.lcm",
        "press3_20261121T070005Z_007.lcm.bak", "press3_20261121T070005Z_.lcm", "press3_20261121T070005.lcm",
        "press3_2026-11-21T070005Z.lcm", "press3_important.lcm", "press33_20261121T070005Z.lcm",
        "press3_20261321T070005Z.lcm", "press3_20261121T070005Zcopy.lcm"}) {
    EXPECT_FALSE(LogFileBegin("press3", file)) << file;
  }
}

class ExpiredLogsTest : public ::testing::Test {
 protected:
  // Begun so many hours ago.
  void Add(int hours, std::int64_t bytes) { logs_.push_back({Name(hours), bytes}); }
  [[nodiscard]] static std::string Name(int hours) { return LogFileName("m", kNow - hours * 3'600 * kSecondUs, 0); }
  [[nodiscard]] std::vector<std::string> Expired(const Retention& retention, const std::string& current) const {
    return ExpiredLogs(logs_, "m", current, retention, kNow);
  }

  std::vector<StoredLog> logs_;
};

TEST_F(ExpiredLogsTest, TheOldestGoUntilTheRestFits) {
  Add(1, 50);
  Add(3, 50);
  Add(2, 50);
  logs_.push_back({"precious.lcm", 1'000'000});
  EXPECT_THAT(Expired({.quota_bytes = 150}, Name(1)), IsEmpty());
  EXPECT_THAT(Expired({.quota_bytes = 149}, Name(1)), ElementsAre(Name(3)));
  EXPECT_THAT(Expired({.quota_bytes = 60}, Name(1)), ElementsAre(Name(3), Name(2)));
  EXPECT_THAT(Expired({.quota_bytes = 1}, Name(1)), ElementsAre(Name(3), Name(2))) << "never the current one";
  EXPECT_THAT(Expired({}, Name(1)), IsEmpty());
}

TEST_F(ExpiredLogsTest, LogsOfOneSecondGoInTheirOrder) {
  for (const int copy : {1'000, 999, 2, 0}) logs_.push_back({LogFileName("m", kNow, copy), 10});
  EXPECT_THAT(Expired({.quota_bytes = 10}, ""),
              ElementsAre(LogFileName("m", kNow, 0), LogFileName("m", kNow, 2), LogFileName("m", kNow, 999)));
}

TEST_F(ExpiredLogsTest, ALogGoesWhenItsLastMessageIsTooOld) {
  Add(30, 1);
  Add(20, 1);
  Add(10, 1);
  const Retention day{.keep_us = 15 * 3'600 * kSecondUs};
  EXPECT_THAT(Expired(day, Name(10)), ElementsAre(Name(30))) << "that of 20 hours ago ended 10 hours ago";
  EXPECT_THAT(Expired({.keep_us = kSecondUs}, "elsewhere"), ElementsAre(Name(30), Name(20)))
      << "when the newest ended is not known";
}

TEST_F(ExpiredLogsTest, ItsLastMessageDecidesWhereItIsKnown) {
  Add(30, 1);
  Add(20, 1);
  logs_[0].last_utime = kNow - 14 * 3'600 * kSecondUs;
  logs_[1].last_utime = kNow - 16 * 3'600 * kSecondUs;
  EXPECT_THAT(Expired({.keep_us = 15 * 3'600 * kSecondUs}, "elsewhere"), ElementsAre(Name(20)))
      << "the recorder stood still, and its clock had been set";
}

}  // namespace
}  // namespace axlecast
