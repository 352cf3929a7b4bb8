#include "tools/recorder/log_writer.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cerrno>
#include <filesystem>
#include <fstream>
#include <string>

#include "tests/disk/file_calls.h"
#include "tests/disk/limited_files.h"
#include "tests/disk/memory_folder.h"
#include "tests/support/fake_clock.h"
#include "tests/support/temporary_folder.h"
#include "tools/log/log_event.h"
#include "tools/log/log_name.h"
#include "tools/recorder/recorder_fixture.h"

namespace axlecast {
namespace {

using ::testing::_;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::SizeIs;
using ::testing::UnorderedElementsAre;

constexpr std::int64_t kUtime = 1'795'244'405'000'000;  // 2026-11-21 07:00:05
constexpr std::int64_t kHour = 3'600'000'000;           // us

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
    return std::filesystem::file_size(PathOf(file));
  }
  [[nodiscard]] std::string PathOf(const std::string& file) const { return folder_.path() + '/' + file; }
  [[nodiscard]] std::string ContentOf(const std::string& file) const {
    std::ifstream content(PathOf(file), std::ios::binary);
    return {std::istreambuf_iterator<char>(content), {}};
  }
  void Store(const std::string& file, const std::string& content) const {
    std::ofstream(PathOf(file), std::ios::binary) << content;
  }
  // A log with one event, `hours` ago.
  [[nodiscard]] std::string LogOf(int hours) const {
    std::vector<std::uint8_t> log;
    AppendEvent(log, {0, clock_.UtcMicroseconds() - hours * kHour, "A", {}});
    return std::string(AsText(log));
  }
  // The generated name of a log that began `hours` ago.
  [[nodiscard]] std::string NameOf(int hours) const {
    return LogFileName("m", clock_.UtcMicroseconds() - hours * kHour, 0);
  }
  // One log with one record, which is on the disk.
  LogWriter& MakeOne(const std::string& file, const Retention& retention = {}) {
    LogWriter& writer = Make(file, retention);
    writer.Begin(clock_.UtcMicroseconds());
    writer.Write(Record(0));
    writer.Poll();
    EXPECT_FALSE(writer.blocked());
    return writer;
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

TEST_F(LogWriterTest, NumbersIncreaseAlsoIfAllLogsWereDeleted) {
  LogWriter& writer = Make("");
  for (const char* file : {"m_20261121T070005Z.lcm", "m_20261121T070005Z_001.lcm", "m_20261121T070005Z_002.lcm"}) {
    writer.Begin(kUtime);
    writer.Write(Record(0));
    writer.End();
    writer.Poll();
    EXPECT_THAT(Files(), ElementsAre(file));
    std::filesystem::remove(PathOf(file));
  }
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
  writer.Poll();
  EXPECT_EQ(writer.status().file, PathOf("a.lcm"));
  EXPECT_EQ(writer.status().file_bytes, 4);
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

TEST_F(LogWriterTest, ALogThatIsGivenIsTheFirstOfItsName) {
  Store("a.lcm", "0123");
  LogWriter& writer = Make("a.lcm");
  writer.Append(4);
  for (int i = 0; i < 2; ++i) {
    writer.Begin(kUtime);
    writer.Write(Record(i));
    writer.End();
  }
  writer.Poll();
  EXPECT_EQ(writer.status().file, PathOf("a_001.lcm"));
  EXPECT_THAT(Files(), ElementsAre("a.lcm", "a_001.lcm"));
  EXPECT_EQ(SizeOf("a.lcm"), 4 + Record(0).size());
  EXPECT_EQ(SizeOf("a_001.lcm"), Record(1).size());
}

TEST_F(LogWriterTest, TheFollowingLogsOfAGivenNameReplaceNoFile) {
  Store("a_001.lcm", "precious");
  LogWriter& writer = Make("a.lcm");
  for (int i = 0; i < 3; ++i) {
    writer.Begin(kUtime);
    writer.Write(Record(i));
    writer.End();
    writer.Poll();
  }
  EXPECT_THAT(Files(), ElementsAre("a.lcm", "a_001.lcm", "a_002.lcm", "a_003.lcm"));
  EXPECT_EQ(ContentOf("a_001.lcm"), "precious");
}

TEST_F(LogWriterTest, OneNameHasTenThousandLogs) {
  const MemoryFolder memory;
  for (int copy = 0; copy < 9'999; ++copy) {
    std::filesystem::create_symlink("nothing", memory.path() + '/' + LogFileName("m", kUtime, copy));
  }
  LogWriterSettings settings;
  settings.folder = memory.path();
  settings.name = "m";
  LogWriter writer(settings, clock_);
  for (const bool last : {true, false}) {
    writer.Begin(kUtime);
    writer.Write(Record(0));
    writer.End();
    writer.Poll();
    EXPECT_EQ(writer.blocked(), !last);
  }
  EXPECT_EQ(std::filesystem::file_size(memory.path() + "/m_20261121T070005Z_9999.lcm"), Record(0).size());
  EXPECT_THAT(writer.status().last_error, HasSubstr("File exists"));
}

TEST_F(LogWriterTest, WhatIsWrittenIsSyncedAfterTheIntervalSinceTheFirstOfIt) {
  LogWriter& writer = MakeOne("a.lcm");
  const MonoNs due = clock_.Now() + 100 * kMillisecond;
  clock_.Advance(50 * kMillisecond);
  writer.Write(Record(1));
  writer.Poll();
  EXPECT_EQ(writer.next_poll(), due);
  clock_.MoveTo(due - 1);
  writer.Poll();
  EXPECT_EQ(writer.next_poll(), due);
  clock_.MoveTo(due);
  writer.Poll();
  EXPECT_EQ(writer.next_poll(), clock_.Now() - 100 * kMillisecond + kSecond) << "the next deletion";
}

TEST_F(LogWriterTest, ALogThatEndsIsClosedWithoutBeingAsked) {
  LogWriter& writer = MakeOne("a.lcm");
  EXPECT_TRUE(LogFile::IsBeingWritten(PathOf("a.lcm")));
  writer.End();
  writer.Poll();
  EXPECT_FALSE(LogFile::IsBeingWritten(PathOf("a.lcm")));
  EXPECT_EQ(writer.next_poll(), clock_.Now() + kSecond) << "nothing remains to be synced";
}

TEST_F(LogWriterTest, OneMegabyteIsWrittenAtOnceUnlessTheDiskIsBlocked) {
  constexpr std::size_t kMegabyte = 1 << 20;
  const std::size_t head = Record(0, "").size();
  LogWriter& writer = Make("later/a.lcm");
  writer.Begin(kUtime);
  writer.Poll();
  ASSERT_TRUE(writer.blocked()) << "there is no folder";
  std::filesystem::create_directory(PathOf("later"));
  writer.Write(Record(0, std::string(kMegabyte - 1 - head, 'x')));
  writer.Write(Record(1));
  EXPECT_FALSE(std::filesystem::exists(PathOf("later/a.lcm"))) << "it is tried once a second";
  clock_.Advance(kSecond);
  writer.Poll();
  const std::size_t before = SizeOf("later/a.lcm");
  EXPECT_EQ(before, kMegabyte - 1 + Record(1).size());
  writer.Write(Record(2, std::string(kMegabyte - 1 - head, 'x')));
  EXPECT_EQ(SizeOf("later/a.lcm"), before) << "one byte is missing";
  writer.Poll();
  writer.Write(Record(3, std::string(kMegabyte - head, 'x')));
  EXPECT_EQ(SizeOf("later/a.lcm"), before + 2 * kMegabyte - 1);
}

struct FailedWrite {
  int error;
  DiskState state;
  const char* text;
};

class LogWriterErrorTest : public LogWriterTest, public ::testing::WithParamInterface<FailedWrite> {};

TEST_P(LogWriterErrorTest, AFailedWriteIsReportedWithItsFixAndTriedAgain) {
  LogWriter& writer = MakeOne("a.lcm");
  clock_.Advance(500 * kMillisecond);
  writer.Write(Record(1));
  FileCalls::PlantWrite(-1, GetParam().error);
  writer.Poll();
  const MonoNs failed = clock_.Now();
  EXPECT_TRUE(writer.blocked());
  EXPECT_EQ(writer.status().state, GetParam().state);
  EXPECT_EQ(writer.status().last_error, PathOf("a.lcm") + ": " + GetParam().text);
  EXPECT_EQ(writer.status().last_error_utime, clock_.UtcMicroseconds());
  EXPECT_FALSE(writer.status().damaged);
  clock_.Advance(500 * kMillisecond);
  writer.Poll();
  EXPECT_EQ(writer.next_poll(), failed + kSecond);
  clock_.MoveTo(failed + kSecond - 1);
  writer.Poll();
  EXPECT_TRUE(writer.blocked());
  EXPECT_EQ(SizeOf("a.lcm"), Record(0).size());
  clock_.MoveTo(failed + kSecond);
  writer.Poll();
  EXPECT_FALSE(writer.blocked());
  EXPECT_EQ(writer.status().state, DiskState::kGood);
  EXPECT_EQ(SizeOf("a.lcm"), 2 * Record(0).size());
}

INSTANTIATE_TEST_SUITE_P(
    Errors, LogWriterErrorTest,
    ::testing::Values(
        FailedWrite{ENOSPC, DiskState::kFull,
                    "No space left on device; free some space: recording continues by itself"},
        FailedWrite{EDQUOT, DiskState::kFull,
                    "Disk quota exceeded; raise the disk quota or free some space: recording continues by itself"},
        FailedWrite{EACCES, DiskState::kFailed, "Permission denied; choose a folder that this user may write to"},
        FailedWrite{EPERM, DiskState::kFailed,
                    "Operation not permitted; choose a folder that this user may write to"},
        FailedWrite{EROFS, DiskState::kFailed,
                    "Read-only file system; choose a folder that this user may write to"},
        FailedWrite{EIO, DiskState::kFailed, "Input/output error"}));

class LogWriterSpaceTest : public LogWriterTest {
 protected:
  const std::size_t size_ = Record(0).size();
};

TEST_F(LogWriterSpaceTest, AFileEndsWithAWholeRecordWhenItCannotGrow) {
  LogWriter& writer = MakeOne("a.lcm");
  for (int i = 1; i < 4; ++i) writer.Write(Record(i));
  {
    const FileSizeLimit limit(3 * size_ - 1);
    writer.Poll();
  }
  EXPECT_TRUE(writer.blocked());
  EXPECT_EQ(writer.status().state, DiskState::kFailed);
  EXPECT_EQ(SizeOf("a.lcm"), 2 * size_);
  EXPECT_EQ(writer.status().file_bytes, static_cast<std::int64_t>(2 * size_));
  clock_.Advance(kSecond);
  writer.Poll();
  EXPECT_EQ(writer.Finish(), 0);
  EXPECT_EQ(ContentOf("a.lcm").size(), 4 * size_);
  EXPECT_THAT(MessagesIn(AsBytes(ContentOf("a.lcm"))), ElementsAre("A=x", "A=x", "A=x", "A=x"));
}

TEST_F(LogWriterSpaceTest, AWholeRecordAtTheEndOfWhatFitsIsKept) {
  LogWriter& writer = MakeOne("a.lcm");
  for (int i = 1; i < 3; ++i) writer.Write(Record(i));
  const FileSizeLimit limit(2 * size_);
  writer.Poll();
  EXPECT_EQ(SizeOf("a.lcm"), 2 * size_);
  EXPECT_EQ(writer.Finish(), 1);
  EXPECT_EQ(SizeOf("a.lcm"), 2 * size_);
}

TEST_F(LogWriterSpaceTest, WhatIsWrittenBeforeTheDiskIsFullIsSynced) {
  LogWriter& writer = Make("a.lcm");
  writer.Begin(kUtime);
  writer.Write(Record(0));
  writer.Write(Record(1));
  const FileSizeLimit limit(size_);
  writer.Poll();
  EXPECT_TRUE(writer.blocked());
  EXPECT_EQ(writer.next_poll(), clock_.Now() + 100 * kMillisecond);
}

TEST_F(LogWriterSpaceTest, WhatIsNotWrittenNeedsNoSync) {
  LogWriter& writer = Make("a.lcm");
  writer.Begin(kUtime);
  writer.Write(Record(0));
  FileCalls::PlantWrite(-1, ENOSPC);
  writer.Poll();
  EXPECT_EQ(writer.next_poll(), clock_.Now() + kSecond);
}

TEST_F(LogWriterSpaceTest, OnlyMessagesCountAsUnwritten) {
  LogWriter& writer = MakeOne("a.lcm");
  std::vector<std::uint8_t> seal;
  AppendEvent(seal, {1, kUtime, kSealChannel, {}});
  writer.Write(seal);
  writer.Write(Record(2));
  writer.End();
  writer.Begin(kUtime);
  writer.Write(Record(0));
  const FileSizeLimit limit(size_);
  EXPECT_EQ(writer.Finish(), 2);
  EXPECT_EQ(writer.Finish(), 0) << "they were counted";
  EXPECT_THAT(Files(), ElementsAre("a.lcm"));
}

// The bytes behind the end from which it continues may not be overwritten, and those before it never.
TEST_F(LogWriterSpaceTest, AFileThatCannotBeCutToItsEndIsNotContinued) {
  const SealedFile file;
  std::ofstream(file.path()) << "0123456789";
  file.Seal();
  LogWriterSettings settings;
  settings.file = file.path();
  LogWriter writer(settings, clock_);
  writer.Append(4);
  writer.Begin(kUtime);
  writer.Write(Record(0));
  for (int i = 0; i < 3; ++i) {
    writer.Poll();
    EXPECT_TRUE(writer.blocked()) << i;
    clock_.Advance(kSecond);
  }
  EXPECT_EQ(file.Content(), "0123456789");
}

// A file that cannot be truncated either: its torn record is completed by the next write.
TEST_F(LogWriterSpaceTest, ATornRecordThatCannotBeCutIsCompleted) {
  const SealedFile file;
  LogWriterSettings settings;
  settings.file = file.path();
  LogWriter writer(settings, clock_);
  writer.Append(0);
  writer.Begin(kUtime);
  writer.Poll();
  ASSERT_FALSE(writer.blocked()) << writer.status().last_error;
  file.Seal();
  for (int i = 0; i < 3; ++i) writer.Write(Record(i));
  {
    const FileSizeLimit limit(2 * size_ - 1);
    writer.Poll();
  }
  EXPECT_TRUE(writer.blocked());
  EXPECT_EQ(writer.status().file_bytes, static_cast<std::int64_t>(2 * size_ - 1));
  clock_.Advance(kSecond);
  writer.Poll();
  EXPECT_FALSE(writer.blocked());
  const std::string content = file.Content();
  EXPECT_EQ(content.size(), 3 * size_);
  EXPECT_THAT(MessagesIn(AsBytes(content)), ElementsAre("A=x", "A=x", "A=x"));
}

// The folder has another name for a while, so that the name of the log cannot be synced.
TEST_F(LogWriterTest, WhatMayNotBeOnTheDiskIsReportedForEver) {
  std::filesystem::create_directory(PathOf("logs"));
  LogWriter& writer = MakeOne("logs/a.lcm");
  std::filesystem::rename(PathOf("logs"), PathOf("elsewhere"));
  clock_.Advance(100 * kMillisecond);
  writer.Poll();
  EXPECT_TRUE(writer.status().damaged);
  EXPECT_EQ(writer.status().state, DiskState::kFailed);
  EXPECT_EQ(writer.status().last_error,
            PathOf("logs/a.lcm") + ": written data may not be on the disk: No such file or directory");
  EXPECT_EQ(writer.status().last_error_utime, clock_.UtcMicroseconds());
  EXPECT_FALSE(writer.blocked()) << "it is still written";
  std::filesystem::rename(PathOf("elsewhere"), PathOf("logs"));
  writer.Write(Record(1));
  writer.Poll();
  EXPECT_EQ(SizeOf("logs/a.lcm"), 2 * Record(0).size());
  EXPECT_EQ(writer.status().state, DiskState::kFailed);
  EXPECT_TRUE(writer.status().damaged);
}

TEST_F(LogWriterTest, ALogThatEndsAndIsNotOnTheDiskIsDamaged) {
  std::filesystem::create_directory(PathOf("logs"));
  for (const bool last : {false, true}) {
    LogWriter& writer = MakeOne(last ? "logs/b.lcm" : "logs/a.lcm");
    if (!last) writer.End();
    std::filesystem::rename(PathOf("logs"), PathOf("elsewhere"));
    if (last) {
      EXPECT_EQ(writer.Finish(), 0);
    } else {
      writer.Poll();
    }
    EXPECT_TRUE(writer.status().damaged) << last;
    std::filesystem::rename(PathOf("elsewhere"), PathOf("logs"));
  }
}

TEST_F(LogWriterTest, ARecordingThatEndsBeforeItsFirstLogIsNotDamaged) {
  LogWriter& writer = Make("");
  EXPECT_EQ(writer.Finish(), 0);
  EXPECT_FALSE(writer.status().damaged);
  EXPECT_EQ(writer.status().last_error, "");
}

TEST_F(LogWriterTest, LooksForExpiredLogsOnceASecondAndWithEachLog) {
  LogWriter& writer = Make("", {.quota_bytes = 100});
  writer.Poll();
  EXPECT_EQ(writer.next_poll(), clock_.Now() + kSecond);
  Store("m_20201121T070005Z.lcm", std::string(500, 'x'));
  writer.Begin(kUtime);
  writer.Write(Record(0));
  writer.Poll();
  EXPECT_THAT(Files(), ElementsAre("m_20261121T070005Z.lcm")) << "there is a new log";
  Store("m_20201121T070005Z.lcm", std::string(500, 'x'));
  clock_.Advance(kSecond - 1);
  writer.Poll();
  EXPECT_THAT(Files(), SizeIs(2));
  clock_.Advance(1);
  writer.Poll();
  EXPECT_THAT(Files(), ElementsAre("m_20261121T070005Z.lcm"));
}

TEST_F(LogWriterTest, ARecordingWithAGivenNameDeletesNoLogs) {
  Store("m_20201121T070005Z.lcm", std::string(500, 'x'));
  Store("m_20211121T070005Z.lcm", std::string(500, 'x'));
  MakeOne("a.lcm", {.quota_bytes = 1, .keep_us = kHour});
  EXPECT_THAT(Files(), ElementsAre("a.lcm", "m_20201121T070005Z.lcm", "m_20211121T070005Z.lcm"));
}

TEST_F(LogWriterTest, TheSmallestLimitsDeleteAllThatIsNotWritten) {
  Store(NameOf(2), LogOf(1));
  Make("", {.keep_us = 1}).Poll();
  EXPECT_THAT(Files(), IsEmpty());
  Store(NameOf(2), LogOf(1));
  LogWriter& writer = MakeOne("", {.quota_bytes = 1});
  EXPECT_THAT(Files(), ElementsAre(NameOf(0)));
  EXPECT_EQ(writer.status().last_error, "");
}

// The clock was set back: the log that is written is not the newest one.
TEST_F(LogWriterTest, TheLogThatIsWrittenCountsAgainstTheQuotaAndIsKept) {
  LogWriter& writer = Make("", {.quota_bytes = 250});
  Store(NameOf(2), std::string(100, 'x'));
  Store(NameOf(1), std::string(100, 'x'));
  writer.Begin(clock_.UtcMicroseconds() - 3 * kHour);
  writer.Write(Record(0, std::string(100, 'x')));
  writer.Poll();
  EXPECT_THAT(Files(), ElementsAre(NameOf(3), NameOf(1)));
}

TEST_F(LogWriterTest, AFolderWithTheNameOfALogIsKept) {
  std::filesystem::create_directory(PathOf("m_20191121T070005Z.lcm"));
  Store("m_20201121T070005Z.lcm", std::string(500, 'x'));
  MakeOne("", {.quota_bytes = 100});
  EXPECT_THAT(Files(), ElementsAre("m_20191121T070005Z.lcm", NameOf(0)));
}

TEST_F(LogWriterTest, ALogThatCannotBeDeletedIsReported) {
  const std::string file = "m_20201121T070005Z.lcm";
  Store(file, std::string(500, 'x'));
  std::filesystem::permissions(folder_.path(), std::filesystem::perms(0555));
  LogWriter& writer = Make("", {.keep_us = kHour});
  Store("m_20211121T070005Z.lcm", "");
  {
    const WithoutPrivileges user;
    writer.Poll();
  }
  std::filesystem::permissions(folder_.path(), std::filesystem::perms::owner_all);
  EXPECT_EQ(writer.status().last_error, file + ": cannot be deleted: Permission denied");
  EXPECT_EQ(writer.status().last_error_utime, clock_.UtcMicroseconds());
  EXPECT_EQ(writer.status().state, DiskState::kGood);
}

TEST_F(LogWriterTest, ALogIsReadOnceForTheTimeOfItsLastEvent) {
  const std::string old = NameOf(30);
  Store(old, LogOf(20));
  LogWriter& writer = MakeOne("", {.keep_us = 24 * kHour});
  Store(old, LogOf(29));
  clock_.Advance(kSecond);
  writer.Poll();
  EXPECT_THAT(Files(), ElementsAre(old, _)) << "its last event was 20 hours ago";
}

// Another recorder continues it meanwhile.
TEST_F(LogWriterTest, ALogIsNotReadBeforeItMayHaveExpired) {
  const std::string log = NameOf(10);
  Store(log, LogOf(10));
  LogWriter& writer = Make("", {.keep_us = 24 * kHour});
  writer.Poll();
  Store(log, LogOf(2));
  clock_.Advance(15 * 3'600 * kSecond);
  writer.Poll();
  EXPECT_THAT(Files(), ElementsAre(log)) << "its last event was 17 hours ago";
  clock_.Advance(8 * 3'600 * kSecond);
  writer.Poll();
  EXPECT_THAT(Files(), IsEmpty());
}

// The clock was set back after it had begun.
TEST_F(LogWriterTest, ALogIsReadWhenItBeganBeforeTheTimeThatIsKept) {
  const std::string log = NameOf(24);
  Store(log, LogOf(25));
  LogWriter& writer = Make("", {.keep_us = 24 * kHour});
  writer.Poll();
  EXPECT_THAT(Files(), ElementsAre(log));
  clock_.Advance(kSecond);
  writer.Poll();
  EXPECT_THAT(Files(), IsEmpty());
}

TEST_F(LogWriterTest, ALogThatCannotBeReadEndsWhenTheNextOneBegins) {
  const std::string unreadable = NameOf(30);
  const std::string next = NameOf(20);
  Store(unreadable, LogOf(30));
  Store(next, LogOf(10));
  std::filesystem::permissions(PathOf(unreadable), std::filesystem::perms::none);
  std::filesystem::permissions(folder_.path(), std::filesystem::perms(0777));
  LogWriter& writer = Make("", {.keep_us = 24 * kHour});
  const WithoutPrivileges user;
  writer.Poll();
  EXPECT_THAT(Files(), ElementsAre(unreadable, next));
  clock_.Advance(5 * 3'600 * kSecond);
  writer.Poll();
  EXPECT_THAT(Files(), ElementsAre(next)) << "the next one began 25 hours ago";
}

TEST_F(LogWriterTest, FreeBytesAreUnknownWithoutAFolder) {
  LogWriterSettings settings;
  settings.folder = PathOf("later");
  settings.name = "m";
  std::filesystem::create_directory(settings.folder);
  LogWriter writer(settings, clock_);
  writer.Poll();
  EXPECT_GT(writer.status().free_bytes, 0);
  std::filesystem::remove(settings.folder);
  clock_.Advance(kSecond);
  writer.Poll();
  EXPECT_EQ(writer.status().free_bytes, -1);
}

TEST_F(LogWriterTest, FreeBytesAreUnknownBeforeTheFirstFileOfARecordingWithoutAFolder) {
  LogWriterSettings settings;
  settings.file = PathOf("a.lcm");
  LogWriter writer(settings, clock_);
  writer.Poll();
  EXPECT_EQ(writer.status().free_bytes, -1);
}

TEST_F(LogWriterTest, FreeBytesAreThoseOfTheFileThatIsWritten) {
  LogWriterSettings settings;
  settings.folder = "/proc";  // a disk without space
  settings.file = PathOf("a.lcm");
  LogWriter writer(settings, clock_);
  writer.Poll();
  EXPECT_EQ(writer.status().free_bytes, 0);
  writer.Begin(kUtime);
  writer.Write(Record(0));
  writer.Poll();
  EXPECT_GT(writer.status().free_bytes, 0);
}

}  // namespace
}  // namespace axlecast
