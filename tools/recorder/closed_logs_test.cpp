#include "tools/recorder/closed_logs.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <string>
#include <thread>
#include <vector>

#include "platform/os/log_file.h"
#include "tests/disk/memory_folder.h"
#include "tools/log/log_event.h"
#include "tools/log/log_holes.h"
#include "tools/log/log_name.h"
#include "tools/log/opened_log.h"
#include "tools/recorder/recorder_fixture.h"

namespace axlecast {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::SizeIs;

constexpr std::int64_t kHour = 3'600'000'000;           // us
constexpr std::int64_t kNow = 1'795'244'405'000'000;    // 2026-11-21 07:00:05
constexpr std::int64_t kEverything = INT64_C(1) << 60;  // bytes; no disk has as much free

class ClosedLogsTest : public ::testing::Test {
 protected:
  [[nodiscard]] static std::string Name(int hours) { return LogFileName("m", kNow - hours * kHour, 0); }
  [[nodiscard]] std::string PathOf(const std::string& file) const { return folder_.path() + '/' + file; }
  // A log that began `hours` ago and ended an hour later.
  std::string Store(int hours) const {
    std::vector<std::uint8_t> log;
    const std::string head =
        R"({"name":"events","host":"press3","start_utime":7,"file_number":)" + std::to_string(hours) + '}';
    AppendEvent(log, {0, kNow - hours * kHour, kRecorderChannel, AsBytes(head)});
    AppendEvent(log, {1, kNow - hours * kHour, "A", AsBytes(std::string(1'000, 'a'))});
    AppendEvent(log, {2, kNow - (hours - 1) * kHour, "A", {}});
    std::ofstream(PathOf(Name(hours)), std::ios::binary) << AsText(log);
    return Name(hours);
  }
  [[nodiscard]] std::vector<std::string> Files() const {
    std::vector<std::string> files;
    for (const auto& entry : std::filesystem::directory_iterator(folder_.path())) {
      const std::string file = entry.path().filename().string();
      if (LogFilePrefix(file) == "m" || !LogFilePrefix(file.substr(0, file.size() - 7)).empty())
        files.push_back(file);
    }
    std::sort(files.begin(), files.end());
    return files;
  }
  ClosedLogs& Make(const Retention& retention, bool compress = false) {
    return logs_.emplace(folder_.path(), "m", retention, compress);
  }
  // Until nothing is compressed any more.
  void TendAll(const std::string& current = "") {
    ASSERT_TRUE(logs_);
    for (std::vector<std::string> before = {"?"}; before != Files() || CountPlain(current) > 0;) {
      before = Files();
      logs_->Tend(current, now_ += kSecond, kNow);
      std::this_thread::yield();
    }
  }
  [[nodiscard]] std::ptrdiff_t CountPlain(const std::string& current) const {
    const std::vector<std::string> files = Files();
    return std::count_if(files.begin(), files.end(),
                         [&](const std::string& file) { return file.ends_with(".lcm") && file != current; });
  }
  void Tend(const std::string& current = "") { logs_->Tend(current, now_ += kSecond, kNow); }
  void Ship(const std::string& file, const ShippedLog& log) const {
    ASSERT_TRUE(MarkShipped(folder_.path(), {.logs = {{file, log}}, .utime = kNow}));
  }
  [[nodiscard]] std::vector<LogHole> Holes() const {
    return ReadHoles(folder_.path(), {}).value_or(std::vector<LogHole>());
  }

  const MemoryFolder folder_;
  std::optional<ClosedLogs> logs_;
  MonoNs now_ = kSecond;
};

TEST_F(ClosedLogsTest, DeletesOnlyWhatIsShipped) {
  for (const int hours : {5, 4, 3, 2}) Store(hours);
  Make({.quota_bytes = 1, .needs_shipping = true});
  Tend();
  EXPECT_THAT(Files(), SizeIs(4)) << "nothing is shipped without shipped.json";
  EXPECT_EQ(logs_->status().held_logs, 3);
  EXPECT_EQ(logs_->status().held_bytes, 3 * static_cast<std::int64_t>(std::filesystem::file_size(PathOf(Name(5)))));
  Ship(Name(5), {3, true, 0});
  Ship(Name(4), {2, false, 0});
  Tend();
  EXPECT_THAT(Files(), ElementsAre(Name(4), Name(3), Name(2)));
  EXPECT_EQ(logs_->status().held_logs, 2);
  Ship(Name(4), {3, true, 0});
  Ship(Name(3), {3, true, 0});
  Tend();
  EXPECT_THAT(Files(), ElementsAre(Name(2)));
  EXPECT_EQ(logs_->status().held_logs, 0);
  EXPECT_EQ(logs_->status().held_bytes, 0);
  EXPECT_EQ(logs_->status().deleted_unshipped, 0);
  EXPECT_EQ(logs_->TakeError(), "");
  EXPECT_THAT(Holes(), IsEmpty());
}

TEST_F(ClosedLogsTest, WhatIsTooOldWaitsAsWell) {
  for (const int hours : {50, 40, 2}) Store(hours);
  Make({.keep_us = 24 * kHour, .needs_shipping = true});
  Tend();
  EXPECT_THAT(Files(), SizeIs(3));
  Ship(Name(40), {3, true, 0});
  Tend();
  EXPECT_THAT(Files(), ElementsAre(Name(50), Name(2)));
}

TEST_F(ClosedLogsTest, ADamagedListHasNothing) {
  for (const int hours : {5, 4, 3}) Store(hours);
  Ship(Name(5), {3, true, 0});
  std::filesystem::resize_file(PathOf("shipped.json"), std::filesystem::file_size(PathOf("shipped.json")) - 3);
  Make({.quota_bytes = 1, .needs_shipping = true});
  Tend();
  EXPECT_THAT(Files(), SizeIs(3));
  EXPECT_THAT(logs_->TakeError(), HasSubstr("shipped.json is damaged"));
  Tend();
  EXPECT_EQ(logs_->TakeError(), "") << "reported once";
}

TEST_F(ClosedLogsTest, AFullDiskTakesTheOldestAndLeavesItsHole) {
  for (const int hours : {6, 5, 4, 3}) Store(hours);
  const auto bytes = static_cast<std::int64_t>(std::filesystem::file_size(PathOf(Name(5))));
  Ship(Name(6), {3, true, 0});
  Ship(Name(5), {2, false, 0});
  Make({.quota_bytes = 1, .needs_shipping = true, .reserve_bytes = kEverything});
  Tend(Name(3));
  EXPECT_THAT(Files(), ElementsAre(Name(4), Name(3))) << "one at a time, as its space may come late";
  EXPECT_EQ(logs_->status().deleted_unshipped, 1);
  EXPECT_THAT(logs_->TakeError(), HasSubstr(Name(5) + ": deleted before it was shipped"));
  LogHole expected;
  expected.file = Name(5);
  expected.name = "events";
  expected.host = "press3";
  expected.start_utime = 7;
  expected.file_number = 5;
  expected.first_event = 2;
  expected.last_utime = kNow - 4 * kHour;
  expected.bytes = bytes;
  expected.cause = "disk nearly full";
  expected.utime = kNow;
  EXPECT_THAT(Holes(), ElementsAre(expected));
  Tend(Name(3));
  Tend(Name(3));
  EXPECT_THAT(Files(), ElementsAre(Name(3))) << "never the log that is being written";
  EXPECT_THAT(Holes(), SizeIs(2));
  EXPECT_EQ(logs_->status().held_logs, 0);
}

TEST_F(ClosedLogsTest, AReserveInPercentCountsToo) {
  for (const int hours : {5, 4}) Store(hours);
  Make({.quota_bytes = 1, .needs_shipping = true, .reserve_percent = 101});
  Tend();
  EXPECT_THAT(Files(), ElementsAre(Name(4)));
}

TEST_F(ClosedLogsTest, LogsWithinQuotaAndKeepStayOnAFullDisk) {
  for (const int hours : {5, 4, 3}) Store(hours);
  Make({.quota_bytes = 1'000'000, .needs_shipping = true, .reserve_bytes = kEverything});
  Tend();
  EXPECT_THAT(Files(), SizeIs(3));
}

TEST_F(ClosedLogsTest, WithoutAHoleNothingGoes) {
  for (const int hours : {5, 4, 3}) Store(hours);
  Make({.quota_bytes = 1, .needs_shipping = true, .reserve_bytes = kEverything});
  Tend(Name(3));
  EXPECT_THAT(Files(), SizeIs(2));
  std::filesystem::remove(PathOf("holes.jsonl"));
  std::filesystem::create_directory(PathOf("holes.jsonl"));
  Tend(Name(3));
  EXPECT_THAT(Files(), SizeIs(2));
  EXPECT_THAT(logs_->TakeError(), HasSubstr(Name(4) + " is not deleted, although the disk is nearly full"));
  std::filesystem::remove(PathOf("holes.jsonl"));
  {
    const auto lock = LockOutbox(folder_.path());
    Tend(Name(3));
    EXPECT_THAT(Files(), SizeIs(2)) << "the shipper is writing";
  }
  Tend(Name(3));
  EXPECT_THAT(Files(), SizeIs(1));
}

// The recorder was killed between the line and the deletion; then the shipper could ship the log.
TEST_F(ClosedLogsTest, AKilledDeletionLeavesNoHole) {
  for (const int hours : {5, 4}) Store(hours);
  LogHole hole;
  hole.file = Name(5);
  ASSERT_TRUE(AppendHole(folder_.path(), hole));
  Make({.quota_bytes = 1, .needs_shipping = true});
  Tend();
  Ship(Name(5), {3, true, 0});
  Tend();
  EXPECT_THAT(Files(), ElementsAre(Name(4)));
  EXPECT_THAT(Holes(), IsEmpty());
}

TEST_F(ClosedLogsTest, ADeletionThatFailsLeavesNoHole) {
  for (const int hours : {5, 4}) Store(hours);
  // A file of the same name with the ending that a compressed log has, which cannot be removed.
  std::filesystem::create_directories(PathOf(Name(5) + ".zst/x"));
  Make({.quota_bytes = 1, .needs_shipping = true, .reserve_bytes = kEverything});
  Tend();
  EXPECT_THAT(logs_->TakeError(), HasSubstr(Name(5) + ": cannot be deleted"));
  EXPECT_EQ(logs_->status().deleted_unshipped, 0);
  EXPECT_TRUE(std::filesystem::exists(PathOf(Name(5))));
  std::filesystem::remove_all(PathOf(Name(5) + ".zst"));
  std::filesystem::remove(PathOf(Name(5)));
  EXPECT_THAT(Holes(), IsEmpty());
}

TEST_F(ClosedLogsTest, CompressesAllButTheCurrentOne) {
  for (const int hours : {5, 4, 3}) Store(hours);
  const OpenedLog before(PathOf(Name(5)));
  std::ofstream(PathOf("m_important.lcm")) << "x";
  Make({}, true);
  TendAll(Name(3));
  EXPECT_THAT(Files(), ElementsAre(Name(5) + ".zst", Name(4) + ".zst", Name(3)));
  EXPECT_TRUE(std::filesystem::exists(PathOf("m_important.lcm"))) << "not generated";
  EXPECT_TRUE(std::ranges::equal(OpenedLog(PathOf(Name(5))).bytes(), before.bytes()));
  EXPECT_EQ(logs_->TakeError(), "");
}

TEST_F(ClosedLogsTest, ALogOfAnotherRecorderWithThisNameIsNotCompressed) {
  for (const int hours : {5, 4}) Store(hours);
  LogFile other;
  ASSERT_EQ(other.Continue(PathOf(Name(5)), static_cast<std::int64_t>(std::filesystem::file_size(PathOf(Name(5))))),
            0);
  Make({}, true);
  TendAll(Name(5));
  EXPECT_THAT(Files(), ElementsAre(Name(5), Name(4) + ".zst"));
  ASSERT_EQ(other.Close(), 0);
  TendAll();
  EXPECT_THAT(Files(), ElementsAre(Name(5) + ".zst", Name(4) + ".zst"));
}

TEST_F(ClosedLogsTest, QuotaAndKeepCountCompressedLogs) {
  for (const int hours : {50, 30, 3, 2}) Store(hours);
  Make({}, true);
  TendAll();
  const auto bytes = static_cast<std::int64_t>(std::filesystem::file_size(PathOf(Name(2) + ".zst")));
  Make({.keep_us = 29 * kHour});
  Tend();
  EXPECT_THAT(Files(), ElementsAre(Name(30) + ".zst", Name(3) + ".zst", Name(2) + ".zst"))
      << "the second one ended 29 hours ago: its summary has the time";
  Make({.quota_bytes = 2 * bytes + 100});
  Tend();
  EXPECT_THAT(Files(), ElementsAre(Name(3) + ".zst", Name(2) + ".zst"));
}

TEST_F(ClosedLogsTest, ACompressedLogLeavesItsHoleToo) {
  for (const int hours : {5, 4}) Store(hours);
  Make({}, true);
  TendAll();
  Make({.quota_bytes = 1, .needs_shipping = true, .reserve_bytes = kEverything}, true);
  Tend();
  ASSERT_THAT(Holes(), SizeIs(1));
  EXPECT_EQ(Holes()[0].file, Name(5));
  EXPECT_EQ(Holes()[0].host, "press3");
  EXPECT_EQ(Holes()[0].file_number, 5);
  EXPECT_EQ(Holes()[0].last_utime, kNow - 4 * kHour);
  EXPECT_THAT(Files(), ElementsAre(Name(4) + ".zst"));
}

TEST_F(ClosedLogsTest, BothFormsOfALogGoTogether) {
  for (const int hours : {5, 4}) Store(hours);
  Make({}, true);
  TendAll();
  Store(5);
  Make({.quota_bytes = 1});
  Tend();
  EXPECT_THAT(Files(), ElementsAre(Name(4) + ".zst"));
}

TEST_F(ClosedLogsTest, WhatAKilledCompressionHasLeftGoesAtTheStart) {
  Store(5);
  std::ofstream(PathOf(Name(5) + ".zst.aB3x9Z")) << "x";
  std::ofstream(PathOf("other_20261121T070005Z.lcm.zst.aB3x9Z")) << "x";
  std::ofstream(PathOf("m_important.lcm.zst.aB3x9Z")) << "x";
  Make({.quota_bytes = 1'000'000});
  Tend();
  EXPECT_FALSE(std::filesystem::exists(PathOf(Name(5) + ".zst.aB3x9Z")));
  EXPECT_TRUE(std::filesystem::exists(PathOf("other_20261121T070005Z.lcm.zst.aB3x9Z")));
  EXPECT_TRUE(std::filesystem::exists(PathOf("m_important.lcm.zst.aB3x9Z")));
  EXPECT_TRUE(std::filesystem::exists(PathOf(Name(5))));
}

TEST_F(ClosedLogsTest, ANearlyFullDiskIsNotFilledByTheCompression) {
  for (const int hours : {5, 4}) Store(hours);
  Make({.needs_shipping = true, .reserve_bytes = kEverything}, true);
  Tend();
  for (std::string error; error.empty(); error = logs_->TakeError()) Tend();
  EXPECT_THAT(Files(), ElementsAre(Name(5), Name(4)));
}

}  // namespace
}  // namespace axlecast
