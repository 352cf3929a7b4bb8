#include "tools/fleet/ship/log_folder.h"

#include <fcntl.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/stat.h>
#include <unistd.h>

#include <filesystem>
#include <fstream>
#include <map>

#include "platform/os/log_file.h"
#include "tests/support/temporary_folder.h"
#include "tools/log/compressed_log.h"
#include "tools/log/log_fixture.h"

namespace axlecast {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::SizeIs;
using ::testing::UnorderedElementsAre;

constexpr std::int64_t kNow = 1'790'000'000'000'000;

class LogFolderTest : public ::testing::Test {
 protected:
  static std::vector<std::uint8_t> Log(const std::string& name, std::int64_t start,
                                       const std::string& machine = "press3", int messages = 1) {
    ScriptedLog log;
    log.Add(kRecorderChannel, R"({"name":")" + name + R"(","host":"plc1","start_utime":)" + std::to_string(start) +
                                  R"(,"file_number":0})");
    log.Add(kMachineChannel,
            "machine: " + machine +
                "\nrecorder: {logs: {positions: {}, rest: {}}}\nbuses:\n  b0: {family: tformat, simulate: true, "
                "devices: {a: {model: ts5669n127}}}\n");
    for (int i = 0; i < messages; ++i) log.Add("A", "b");
    return log.bytes();
  }
  void Write(const std::string& file, const std::vector<std::uint8_t>& bytes) const {
    std::ofstream(Path(file), std::ios::binary)
        .write(reinterpret_cast<const char*>(bytes.data()), static_cast<std::streamsize>(bytes.size()));
    // As if it was written just now.
    const std::array<timespec, 2> times = {{{kNow / 1'000'000, 0}, {kNow / 1'000'000, 0}}};
    utimensat(AT_FDCWD, Path(file).c_str(), times.data(), 0);
  }
  [[nodiscard]] std::string Path(const std::string& file) const { return folder_.path() + '/' + file; }
  FolderContent Scan(MonoNs mono) { return logs_.Scan({mono, kNow + mono / kMicrosecond}).value(); }
  static std::vector<std::string> Files(const FolderContent& content) {
    std::vector<std::string> files;
    for (const FolderLog& log : content.logs) files.push_back(log.file);
    return files;
  }

  TemporaryFolder folder_;
  LogFolder logs_{folder_.path(), {"press2", "press3"}};
};

TEST_F(LogFolderTest, FindsLogsByTheirHead) {
  Write("renamed.lcm", Log("positions", 5));
  Write("b.lcm", Log("rest", 6, "press2"));
  Write("notes.txt", Log("rest", 7));
  const FolderContent content = Scan(0);
  EXPECT_THAT(Files(content), UnorderedElementsAre("renamed.lcm", "b.lcm"));
  EXPECT_THAT(content.skipped, IsEmpty());
  EXPECT_EQ(content.logs[0].facts->machine, "press3");
}

TEST_F(LogFolderTest, ExplainsWhatIsNotShipped) {
  Write("a.lcm", Log("positions", 5, "press9"));
  Write("b.lcm", Log("byhand", 5));
  Write("c.lcm", {1, 2, 3});
  Write("empty.lcm", {});
  Write("d.lcm", ScriptedLog()
                     .Add(kRecorderChannel, R"({"name":"rest","host":"h","start_utime":1,"file_number":0})")
                     .Add(kMachineChannel, "machine: [")
                     .bytes());
  std::map<std::string, SkippedLog> skipped;
  for (const SkippedLog& log : Scan(0).skipped) skipped[log.file] = log;
  ASSERT_THAT(skipped, SizeIs(4));
  EXPECT_THAT(skipped["a.lcm"].reason, HasSubstr("machine 'press9'"));
  EXPECT_TRUE(skipped["a.lcm"].foreign);
  EXPECT_THAT(skipped["b.lcm"].reason, HasSubstr("by hand"));
  EXPECT_THAT(skipped["c.lcm"].reason, HasSubstr("head"));
  EXPECT_FALSE(skipped["c.lcm"].foreign);
  EXPECT_THAT(skipped["d.lcm"].reason, HasSubstr("cannot be used"));
}

TEST_F(LogFolderTest, ReadsAHeadThatWasNotCompleteBefore) {
  const std::vector<std::uint8_t> log = Log("positions", 5);
  Write("a.lcm", {log.begin(), log.begin() + 90});
  EXPECT_THAT(Scan(0).skipped, SizeIs(1));
  Write("a.lcm", log);
  EXPECT_THAT(Files(Scan(kSecond)), ElementsAre("a.lcm"));
}

// As after a change of its rights.
TEST_F(LogFolderTest, ReadsAFileAgainThatCouldNotBeRead) {
  const std::vector<std::uint8_t> log = Log("positions", 5);
  Write("a.lcm", std::vector<std::uint8_t>(log.size(), 1));
  EXPECT_THAT(Scan(0).skipped, SizeIs(1));
  Write("a.lcm", log);
  EXPECT_THAT(Files(Scan(kSecond)), ElementsAre("a.lcm"));
}

TEST_F(LogFolderTest, NamesAFileThatCannotBeLookedAt) {
  ASSERT_EQ(symlink("a.lcm", Path("a.lcm").c_str()), 0);
  const FolderContent content = Scan(0);
  ASSERT_THAT(content.skipped, SizeIs(1));
  EXPECT_EQ(content.skipped[0].reason, "Too many levels of symbolic links");
  EXPECT_FALSE(content.skipped[0].foreign);
  std::filesystem::remove(Path("a.lcm"));
  Write("a.lcm", Log("positions", 5));
  EXPECT_THAT(Files(Scan(kSecond)), ElementsAre("a.lcm"));
}

TEST_F(LogFolderTest, ALogIsClosedByItsSuccessor) {
  Write("press3-positions_20260921T000000Z.lcm", Log("positions", 5));
  EXPECT_FALSE(Scan(0).logs[0].closed);
  Write("press3-positions_20260921T000001Z.lcm", Log("positions", 6));
  EXPECT_FALSE(Scan(kSecond).logs[0].closed);
  // Neither has been quiet for long.
  Write("press3-positions_20260921T000000Z.lcm", Log("positions", 5, "press3", 9));
  Write("press3-positions_20260921T000001Z.lcm", Log("positions", 6, "press3", 9));
  static_cast<void>(Scan(5 * kSecond));
  const FolderContent content = Scan(LogFolder::kQuiet);
  EXPECT_TRUE(content.logs[0].closed);
  EXPECT_FALSE(content.logs[1].closed);
}

TEST_F(LogFolderTest, ALogThatIsBeingWrittenIsOpenAlthoughAnotherOneHasALaterStart) {
  Write("press3-positions_20360921T000000Z.lcm", Log("positions", 6));  // before the clock was set back
  Write("a.lcm", Log("positions", 5));
  LogFile writer;
  ASSERT_EQ(writer.Continue(Path("a.lcm"), static_cast<std::int64_t>(Log("positions", 5).size())), 0);
  EXPECT_FALSE(Scan(0).logs[0].closed);
  const FolderContent content = Scan(LogFolder::kQuiet + kSecond);
  EXPECT_FALSE(content.logs[0].closed);
  EXPECT_TRUE(content.logs[1].closed);
}

TEST_F(LogFolderTest, ALogIsClosedIfItIsQuietAndNobodyWritesIt) {
  Write("a.lcm", Log("positions", 5));
  EXPECT_FALSE(Scan(0).logs[0].closed);
  LogFile writer;
  ASSERT_EQ(writer.Continue(Path("a.lcm"), static_cast<std::int64_t>(Log("positions", 5).size())), 0);
  EXPECT_FALSE(Scan(LogFolder::kQuiet).logs[0].closed) << "it is locked";
  ASSERT_EQ(writer.Close(), 0);
  EXPECT_TRUE(Scan(LogFolder::kQuiet + 1).logs[0].closed);
  Write("a.lcm", Log("positions", 5, "press3", 9));
  EXPECT_FALSE(Scan(LogFolder::kQuiet + 2).logs[0].closed) << "it has grown";
}

TEST_F(LogFolderTest, ALogThatWasQuietBeforeIsClosedAtOnce) {
  Write("a.lcm", Log("positions", 5));
  EXPECT_TRUE(Scan(LogFolder::kQuiet + kSecond).logs[0].closed);
}

TEST_F(LogFolderTest, TakesOneOfSeveralCopies) {
  const std::vector<std::uint8_t> log = Log("positions", 5);
  Write("press3-positions_20260921T000000Z.lcm", log);
  Write("copy.lcm", Log("positions", 5, "press3", 100));
  LogCompressor compressor;
  const Bytes frame = compressor.Compress(log).value();
  Write("press3-positions_20260921T000000Z.lcm.zst", {frame.begin(), frame.end()});
  FolderContent content = Scan(0);
  EXPECT_THAT(Files(content), ElementsAre("press3-positions_20260921T000000Z.lcm"));
  ASSERT_THAT(content.skipped, SizeIs(1));
  EXPECT_THAT(content.skipped[0].reason, HasSubstr("a copy of press3-positions"));
  std::filesystem::remove(Path("press3-positions_20260921T000000Z.lcm"));
  content = Scan(kSecond);
  EXPECT_THAT(Files(content), ElementsAre("press3-positions_20260921T000000Z.lcm.zst"));
  EXPECT_TRUE(content.logs[0].closed);
}

TEST_F(LogFolderTest, FailsWithoutAFolder) {
  LogFolder none(folder_.path() + "/none", {"press3"});
  EXPECT_THAT(none.Scan({}).error().text, HasSubstr("--folder"));
}

}  // namespace
}  // namespace axlecast
