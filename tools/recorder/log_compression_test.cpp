#include "tools/recorder/log_compression.h"

#include <fcntl.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/stat.h>

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <limits>
#include <string>
#include <thread>
#include <vector>

#include "platform/os/log_file.h"
#include "tests/disk/limited_files.h"
#include "tests/disk/memory_folder.h"
#include "tools/log/compressed_log.h"
#include "tools/log/log_fixture.h"
#include "tools/log/opened_log.h"

namespace axlecast {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;

class LogCompressionTest : public ::testing::Test {
 protected:
  // A log of about `size` bytes.
  [[nodiscard]] static ScriptedLog LogOf(std::size_t size) {
    ScriptedLog log;
    for (int i = 0; log.bytes().size() < size; ++i)
      log.Add("A", std::string(5'000, static_cast<char>('a' + i % 26)));
    return log;
  }
  [[nodiscard]] std::string PathOf(const std::string& file) const { return folder_.path() + '/' + file; }
  void Store(const std::string& file, Bytes content) const {
    std::ofstream(PathOf(file), std::ios::binary) << AsText(content);
  }
  [[nodiscard]] std::vector<std::string> Files() const {
    std::vector<std::string> files;
    for (const auto& entry : std::filesystem::directory_iterator(folder_.path()))
      files.push_back(entry.path().filename().string());
    std::sort(files.begin(), files.end());
    return files;
  }
  [[nodiscard]] static bool Always(CompressionStep) { return true; }

  const MemoryFolder folder_;
};

TEST_F(LogCompressionTest, ReplacesALog) {
  const ScriptedLog log = LogOf(20'000'000);  // three frames
  Store("a.lcm", log.bytes());
  ASSERT_EQ(chmod(PathOf("a.lcm").c_str(), 0640), 0);
  std::vector<CompressionStep> steps;
  const Result<> done = CompressLog(PathOf("a.lcm"), 0, [&](CompressionStep step) {
    steps.push_back(step);
    EXPECT_TRUE(std::filesystem::exists(PathOf("a.lcm")));
    EXPECT_FALSE(std::filesystem::exists(PathOf("a.lcm.zst")));
    return true;
  });
  ASSERT_TRUE(done) << done.error().text;
  using enum CompressionStep;
  EXPECT_THAT(steps, ElementsAre(kPiece, kPiece, kPiece, kReplace));
  EXPECT_THAT(Files(), ElementsAre("a.lcm.zst"));
  const OpenedLog content(PathOf("a.lcm"));
  EXPECT_TRUE(std::ranges::equal(content.bytes(), log.bytes()));
  EXPECT_EQ(content.damage(), "");
  EXPECT_EQ(content.mode(), 0640U);
  const MappedFile file(PathOf("a.lcm.zst"));
  const auto events = static_cast<std::int64_t>(log.offsets().size());
  EXPECT_EQ(FindSummary(file.bytes()),
            (CompressedLogSummary{.bytes = log.bytes().size(),
                                  .first_utime = ScriptedLog::kStart,
                                  .last_utime = ScriptedLog::kStart + (events - 1) * 1'000}));
}

TEST_F(LogCompressionTest, AnEmptyLogHasOnlyASummary) {
  Store("a.lcm", {});
  ASSERT_TRUE(CompressLog(PathOf("a.lcm"), 0, Always));
  EXPECT_THAT(Files(), ElementsAre("a.lcm.zst"));
  const OpenedLog content(PathOf("a.lcm.zst"));
  EXPECT_EQ(content.problem() + content.damage(), "");
  EXPECT_TRUE(content.bytes().empty());
}

TEST_F(LogCompressionTest, GivesUpAtAnyStep) {
  const ScriptedLog log = LogOf(20'000'000);
  Store("a.lcm", log.bytes());
  for (int steps = 0; steps < 4; ++steps) {
    int left = steps;
    EXPECT_TRUE(CompressLog(PathOf("a.lcm"), 0, [&left](CompressionStep) { return left-- > 0; }));
    EXPECT_THAT(Files(), ElementsAre("a.lcm")) << steps;
  }
  EXPECT_TRUE(std::ranges::equal(OpenedLog(PathOf("a.lcm")).bytes(), log.bytes()));
}

// A recorder was killed between the rename and the removal of the log.
TEST_F(LogCompressionTest, ALogThatIsCompressedAlreadyGoes) {
  const ScriptedLog log = LogOf(100'000);
  Store("a.lcm", log.bytes());
  ASSERT_TRUE(CompressLog(PathOf("a.lcm"), 0, Always));
  Store("a.lcm", log.bytes());
  EXPECT_TRUE(CompressLog(PathOf("a.lcm"), 0, [](CompressionStep) { return false; }));
  EXPECT_THAT(Files(), ElementsAre("a.lcm", "a.lcm.zst"));
  ASSERT_TRUE(CompressLog(PathOf("a.lcm"), 0, [](CompressionStep step) {
    EXPECT_EQ(step, CompressionStep::kReplace) << "nothing is compressed again";
    return true;
  }));
  EXPECT_THAT(Files(), ElementsAre("a.lcm.zst"));
}

// And then somebody has continued the log.
TEST_F(LogCompressionTest, AFormerCompressionIsReplaced) {
  const ScriptedLog log = LogOf(100'000);
  const ScriptedLog longer = LogOf(200'000);
  Store("a.lcm", log.bytes());
  ASSERT_TRUE(CompressLog(PathOf("a.lcm"), 0, Always));
  Store("a.lcm", longer.bytes());
  ASSERT_TRUE(CompressLog(PathOf("a.lcm"), 0, Always));
  EXPECT_THAT(Files(), ElementsAre("a.lcm.zst"));
  EXPECT_TRUE(std::ranges::equal(OpenedLog(PathOf("a.lcm.zst")).bytes(), longer.bytes()));
}

TEST_F(LogCompressionTest, ALogThatGrowsIsKept) {
  const ScriptedLog log = LogOf(100'000);
  Store("a.lcm", log.bytes());
  const Result<> done = CompressLog(PathOf("a.lcm"), 0, [&](CompressionStep step) {
    if (step == CompressionStep::kReplace) std::ofstream(PathOf("a.lcm"), std::ios::app) << 'x';
    return true;
  });
  ASSERT_FALSE(done);
  EXPECT_THAT(done.error().text, HasSubstr("has grown"));
  EXPECT_THAT(Files(), ElementsAre("a.lcm"));
}

TEST_F(LogCompressionTest, ALogThatIsCutIsKept) {
  Store("a.lcm", LogOf(100'000).bytes());
  const Result<> done = CompressLog(PathOf("a.lcm"), 0, [&](CompressionStep step) {
    if (step == CompressionStep::kPiece) std::filesystem::resize_file(PathOf("a.lcm"), 50'000);
    return true;
  });
  ASSERT_FALSE(done) << "zeros in place of what is missing must not replace a log";
  EXPECT_THAT(done.error().text, HasSubstr("was made shorter"));
  EXPECT_THAT(Files(), ElementsAre("a.lcm"));
}

TEST_F(LogCompressionTest, ALogThatARecorderWritesIsKept) {
  Store("a.lcm", LogOf(100'000).bytes());
  LogFile writer;
  ASSERT_EQ(writer.Continue(PathOf("a.lcm"), static_cast<std::int64_t>(LogOf(100'000).bytes().size())), 0);
  const Result<> done = CompressLog(PathOf("a.lcm"), 0, Always);
  ASSERT_FALSE(done);
  EXPECT_THAT(done.error().text, HasSubstr("a recorder writes it"));
  EXPECT_THAT(Files(), ElementsAre("a.lcm"));
}

TEST_F(LogCompressionTest, TheLockIsHeldWhileTheLogIsReplaced) {
  Store("a.lcm", LogOf(100'000).bytes());
  ASSERT_TRUE(CompressLog(PathOf("a.lcm"), 0, [&](CompressionStep) {
    EXPECT_FALSE(LogFile::IsBeingWritten(PathOf("a.lcm"))) << "not earlier: a recorder may continue the log";
    return true;
  }));
}

TEST_F(LogCompressionTest, LeavesSpaceOnTheDisk) {
  Store("a.lcm", LogOf(100'000).bytes());
  const Result<> done = CompressLog(PathOf("a.lcm"), std::numeric_limits<std::int64_t>::max(), Always);
  ASSERT_FALSE(done);
  EXPECT_THAT(done.error().text, HasSubstr("a.lcm: not compressed, because the disk is nearly full"));
  EXPECT_THAT(Files(), ElementsAre("a.lcm"));
}

TEST_F(LogCompressionTest, AFullDiskKeepsTheLog) {
  Store("a.lcm", LogOf(9'000'000).bytes());
  {
    const FileSizeLimit limit(100);
    EXPECT_FALSE(CompressLog(PathOf("a.lcm"), 0, Always));
  }
  EXPECT_THAT(Files(), ElementsAre("a.lcm"));
  EXPECT_FALSE(CompressLog(PathOf("nothing.lcm"), 0, Always));
}

TEST(IsUnfinishedCompression, KnowsTheNamesOfNewFile) {
  std::string log;
  EXPECT_TRUE(IsUnfinishedCompression("m_20261121T070005Z.lcm.zst.aB3x9Z", log));
  EXPECT_EQ(log, "m_20261121T070005Z.lcm");
  for (const char* file : {"", ".aB3x9Z", "m.lcm.zst", "m.lcm.zst.", "m.lcm.zst.aB3x9", "m.lcm.zst.aB3x9Zz",
                           "m.lcm.zst.aB3x-Z", "m.lcm.aB3x9Z", "m.lcm.zst-aB3x9Z", "shipped.json.aB3x9Z"}) {
    EXPECT_FALSE(IsUnfinishedCompression(file, log)) << file;
  }
}

class LogCompressionThreadTest : public LogCompressionTest {
 protected:
  void Wait() const {
    while (compression_.busy()) std::this_thread::yield();
  }

  LogCompression compression_;
};

TEST_F(LogCompressionThreadTest, CompressesOneAfterTheOther) {
  for (const char* file : {"a.lcm", "b.lcm"}) {
    Store(file, LogOf(9'000'000).bytes());
    compression_.Start(PathOf(file), 0);
    Wait();
    EXPECT_EQ(compression_.TakeError(), "");
  }
  EXPECT_THAT(Files(), ElementsAre("a.lcm.zst", "b.lcm.zst"));
}

TEST_F(LogCompressionThreadTest, ReportsAnErrorOnce) {
  compression_.Start(PathOf("a.lcm"), 0);
  Wait();
  EXPECT_THAT(compression_.TakeError(), HasSubstr("a.lcm: No such file"));
  EXPECT_EQ(compression_.TakeError(), "");
}

TEST_F(LogCompressionThreadTest, ALogThatIsReleasedIsNotReplaced) {
  Store("a.lcm", LogOf(60'000'000).bytes());
  compression_.Start(PathOf("a.lcm"), 0);
  EXPECT_TRUE(compression_.Release(PathOf("b.lcm"))) << "another one";
  ASSERT_TRUE(compression_.Release(PathOf("a.lcm")));
  std::filesystem::remove(PathOf("a.lcm"));
  Wait();
  EXPECT_EQ(compression_.TakeError(), "");
  EXPECT_THAT(Files(), IsEmpty());
  EXPECT_TRUE(compression_.Release(PathOf("a.lcm"))) << "it is not compressed any more";
  Store("c.lcm", LogOf(100'000).bytes());
  compression_.Start(PathOf("c.lcm"), 0);
  Wait();
  EXPECT_THAT(Files(), ElementsAre("c.lcm.zst")) << "the next one is";
}

TEST_F(LogCompressionThreadTest, EndsEarlyWithItsObject) {
  Store("a.lcm", LogOf(60'000'000).bytes());
  {
    LogCompression compression;
    compression.Start(PathOf("a.lcm"), 0);
  }
  EXPECT_THAT(Files(), ElementsAre("a.lcm"));
}

}  // namespace
}  // namespace axlecast
