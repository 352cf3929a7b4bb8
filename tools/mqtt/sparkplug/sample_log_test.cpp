#include "tools/mqtt/sparkplug/sample_log.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <numeric>
#include <sstream>
#include <string>

#include "tests/support/temporary_folder.h"
#include "tools/log/log_reader.h"

namespace axlecast {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;

constexpr std::int64_t kEnd = INT64_MAX;
constexpr std::int64_t kSecondUs = 1'000'000;

class SampleLogTest : public ::testing::Test {
 protected:
  SampleLogTest() {
    settings_.folder = folder_.path() + "/state/outbox";
    settings_.repeat_us = 10 * kSecondUs;
    Reopen();
  }

  // A kill -9: nothing is closed.
  void Reopen() {
    log_.reset();
    log_.emplace(settings_);
    const Result<> opened = log_->Open();
    ASSERT_TRUE(opened) << opened.error().text;
  }
  // A sample each second.
  std::int64_t Add(const std::string& text) {
    now_ += kSecond;
    utime_ += kSecondUs;
    const std::int64_t number = log_->Append("POSITION/axis1", AsBytes(text), utime_, now_);
    log_->Poll(now_);
    return number;
  }
  void AddMany(int count, std::size_t size = 1) {
    for (int i = 0; i < count; ++i) Add(std::string(size, 'x'));
  }
  std::vector<std::string> Texts(std::int64_t from, std::size_t limit = 1'000'000) {
    std::vector<std::string> texts;
    for (const StoredSample& sample : log_->Read(from, kEnd, limit)) {
      texts.emplace_back(sample.message.begin(), sample.message.end());
    }
    return texts;
  }
  std::vector<std::string> Files() const {
    std::vector<std::string> files;
    for (const auto& entry : std::filesystem::directory_iterator(settings_.folder)) {
      if (entry.path().extension() == ".lcm") files.push_back(entry.path().string());
    }
    std::sort(files.begin(), files.end());
    return files;
  }
  static std::string Content(const std::string& file) {
    std::ostringstream text;
    text << std::ifstream(file, std::ios::binary).rdbuf();
    return text.str();
  }
  static void Write(const std::string& file, const std::string& text) {
    std::ofstream(file, std::ios::binary | std::ios::trunc) << text;
  }

  TemporaryFolder folder_;
  SampleLogSettings settings_;
  std::optional<SampleLog> log_;
  MonoNs now_ = 0;
  std::int64_t utime_ = 1'790'000'000 * kSecondUs;
};

TEST_F(SampleLogTest, WhatIsStoredIsReadInOrder) {
  const std::int64_t first = Add("a");
  const std::int64_t second = Add("b");
  EXPECT_LT(first, second);
  EXPECT_THAT(Texts(0), ElementsAre("a", "b"));
  EXPECT_THAT(Texts(second), ElementsAre("b"));
  EXPECT_THAT(Texts(0, 1), ElementsAre("a"));
  EXPECT_THAT(log_->Read(first, second, 9).size(), 1U);
  const StoredSample sample = log_->Read(first, kEnd, 1).front();
  EXPECT_EQ(sample.number, first);
  EXPECT_EQ(sample.channel, "POSITION/axis1");
  EXPECT_EQ(sample.utime, utime_ - kSecondUs);
}

TEST_F(SampleLogTest, AKilledProcessLosesNothing) {
  Add("a");
  log_->Append("POSITION/axis1", AsBytes("not synced"), utime_, now_);
  Reopen();
  EXPECT_THAT(Texts(0), ElementsAre("a", "not synced"));
  Add("b");
  Reopen();
  EXPECT_THAT(Texts(log_->Resume()), ElementsAre("a", "not synced", "b"));
  EXPECT_EQ(log_->counts().damaged, 0);
}

TEST_F(SampleLogTest, ItsFilesAreLogsThatEveryReaderReads) {
  AddMany(3);
  log_->Close(utime_);
  const std::string bytes = Content(Files().front());
  LogReader reader(AsBytes(bytes));
  std::vector<std::string> channels;
  while (const auto event = reader.Next()) channels.emplace_back(event->channel);
  EXPECT_THAT(reader.damage(), IsEmpty());
  EXPECT_EQ(std::count(channels.begin(), channels.end(), "POSITION/axis1"), 3);
  EXPECT_EQ(channels.front(), kMarkChannel);
  EXPECT_EQ(channels.back(), kSealChannel);
}

TEST_F(SampleLogTest, ATornRecordAtTheEndIsCutOff) {
  AddMany(2);
  Add("last");
  const std::string file = Files().front();
  const std::string whole = Content(file);
  log_.reset();
  for (std::size_t cut = 1; cut < 60; ++cut) {
    Write(file, whole.substr(0, whole.size() - cut));
    Reopen();
    EXPECT_THAT(Texts(0).size(), ::testing::AnyOf(2U, 3U)) << cut;
    Add("after");
    EXPECT_EQ(Texts(0).back(), "after") << cut;
    log_.reset();
  }
}

TEST_F(SampleLogTest, AnEmptyOrStrangeFileIsNoObstacle) {
  Add("a");
  log_.reset();
  Write(settings_.folder + "/samples_0000000000000000999.lcm", "");
  Write(settings_.folder + "/samples_x.lcm", "x");
  Write(settings_.folder + "/notes.txt", "x");
  Reopen();
  Add("b");
  EXPECT_THAT(Texts(0), ElementsAre("a", "b"));
}

TEST_F(SampleLogTest, AStretchWithAWrongCheckSumIsLostAndCounted) {
  Add("first");
  Add("wrong");
  Add("third");
  log_.reset();
  const std::string file = Files().front();
  std::string bytes = Content(file);
  bytes[bytes.find("wrong")] = 'W';
  Write(file, bytes);
  Reopen();
  EXPECT_EQ(Texts(0).back(), "third");
  EXPECT_EQ(log_->counts().damaged, 1);
  static_cast<void>(Texts(0));
  EXPECT_EQ(log_->counts().damaged, 1) << "counted once";
  for (const std::string& text : Texts(0)) EXPECT_NE(text, "Wrong");
}

TEST_F(SampleLogTest, AConfirmationSurvivesARestart) {
  AddMany(30);
  const std::int64_t number = Add("first unconfirmed");
  log_->Confirm(number, utime_ - kSecondUs);
  Reopen();
  EXPECT_EQ(log_->confirmed(), number);
  // The last 10 s before the confirmation are sent again: one each second.
  EXPECT_EQ(Texts(log_->Resume()).size(), 11U);
  log_->Confirm(number - 5, utime_);
  EXPECT_EQ(log_->confirmed(), number) << "it never goes back";
}

TEST_F(SampleLogTest, WithoutARepeatOnlyUnconfirmedSamplesAreSent) {
  settings_.repeat_us = 0;
  Reopen();
  AddMany(3);
  log_->Confirm(log_->next(), utime_ + 1);
  EXPECT_THAT(Texts(log_->Resume()), IsEmpty());
  Add("new");
  Reopen();
  EXPECT_THAT(Texts(log_->Resume()), ElementsAre("new"));
}

TEST_F(SampleLogTest, ConfirmedFilesAreRemoved) {
  settings_.max_bytes = 1 << 20;
  Reopen();
  AddMany(20, 40'000);
  EXPECT_GT(Files().size(), 3U);
  const std::size_t before = Files().size();
  log_->Confirm(log_->next(), utime_);
  AddMany(2);
  EXPECT_LT(Files().size(), before);
  EXPECT_GE(Files().size(), 2U) << "those of the last 10 s stay";
  AddMany(12);
  log_->Confirm(log_->next(), utime_);
  AddMany(2);
  EXPECT_EQ(Files().size(), 1U);
  EXPECT_EQ(log_->counts().dropped, 0);
}

TEST_F(SampleLogTest, TheOldestAreDroppedAndCountedWhenItIsFull) {
  settings_.max_bytes = 1 << 20;
  Reopen();
  AddMany(100, 40'000);
  const SampleLogCounts& counts = log_->counts();
  EXPECT_LE(counts.bytes, settings_.max_bytes);
  EXPECT_GT(counts.bytes, settings_.max_bytes / 2);
  EXPECT_EQ(static_cast<std::int64_t>(Texts(0).size()) + counts.dropped, 100);
  std::int64_t on_disk = 0;
  for (const std::string& file : Files()) on_disk += static_cast<std::int64_t>(std::filesystem::file_size(file));
  EXPECT_EQ(counts.bytes, on_disk);
  Reopen();
  EXPECT_EQ(log_->counts().bytes, on_disk);
}

TEST_F(SampleLogTest, AnotherProcessIsRefused) {
  SampleLog other(settings_);
  const Result<> opened = other.Open();
  ASSERT_FALSE(opened);
  EXPECT_THAT(opened.error().text, HasSubstr("axlecast mqtt"));
}

TEST_F(SampleLogTest, AFolderThatCannotBeIsAnError) {
  Write(folder_.path() + "/file", "");
  settings_.folder = folder_.path() + "/file/outbox";
  SampleLog log(settings_);
  EXPECT_FALSE(log.Open());
}

TEST(SampleMark, IsReadBackAndNothingElse) {
  EXPECT_EQ(ParseMark(FormatMark({17, 1'790'000'000'000'000})), (SampleMark{17, 1'790'000'000'000'000}));
  for (const char* text : {"", "confirmed", "confirmed ", "confirmed 1", "confirmed 1 ", "confirmed -1 2",
                           "confirmed 1 2 ", "confirmed 1 99999999999999999999", "Confirmed 1 2"}) {
    EXPECT_FALSE(ParseMark(text)) << text;
  }
}

}  // namespace
}  // namespace axlecast
