#include "tools/log/opened_log.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <stdlib.h>

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <string>

#include "tests/support/temporary_folder.h"
#include "tools/log/compressed_log.h"
#include "tools/log/log_event.h"
#include "tools/log/log_fixture.h"

namespace axlecast {
namespace {

using ::testing::HasSubstr;
using ::testing::StartsWith;

class OpenedLogTest : public ::testing::Test {
 protected:
  OpenedLogTest() {
    for (int i = 0; i < 5'000; ++i) log_.Add("A", std::string(50, static_cast<char>('a' + i % 26)));
  }
  ~OpenedLogTest() override { unsetenv("TMPDIR"); }

  [[nodiscard]] std::string PathOf(const std::string& file) const { return folder_.path() + '/' + file; }
  [[nodiscard]] std::string Store(const std::string& file, Bytes content) const {
    std::ofstream(PathOf(file), std::ios::binary) << AsText(content);
    return PathOf(file);
  }
  [[nodiscard]] std::vector<std::uint8_t> Compressed() const {
    LogCompressor compressor;
    std::vector<std::uint8_t> file;
    constexpr std::size_t kPiece = 100'000;
    for (Bytes rest = log_.bytes(); !rest.empty(); rest = rest.subspan(std::min(rest.size(), kPiece))) {
      const auto frame = compressor.Compress(rest.first(std::min(rest.size(), kPiece)));
      file.insert(file.end(), frame->begin(), frame->end());
    }
    return file;
  }
  void SetTemporaryFolder(const std::string& path) { setenv("TMPDIR", path.c_str(), 1); }

  const TemporaryFolder folder_;
  ScriptedLog log_;
};

TEST_F(OpenedLogTest, ReadsEitherForm) {
  const OpenedLog plain(Store("a.lcm", log_.bytes()));
  EXPECT_EQ(plain.problem(), "");
  EXPECT_FALSE(plain.compressed());
  EXPECT_TRUE(std::ranges::equal(plain.bytes(), log_.bytes()));
  const std::string path = Store("b.lcm.zst", Compressed());
  std::filesystem::permissions(path, std::filesystem::perms::owner_read);
  const OpenedLog compressed(path);
  EXPECT_EQ(compressed.problem(), "");
  EXPECT_EQ(compressed.path(), path);
  EXPECT_TRUE(compressed.compressed());
  EXPECT_TRUE(std::ranges::equal(compressed.bytes(), log_.bytes()));
  EXPECT_EQ(compressed.file_bytes(), std::filesystem::file_size(path));
  EXPECT_EQ(compressed.mode(), 0400U);
  EXPECT_EQ(compressed.Loss(), "");
  EXPECT_EQ(compressed.damage(), "");
}

TEST_F(OpenedLogTest, TheContentDecides) {
  EXPECT_TRUE(std::ranges::equal(OpenedLog(Store("a.lcm", Compressed())).bytes(), log_.bytes()));
  EXPECT_TRUE(std::ranges::equal(OpenedLog(Store("b.lcm.zst", log_.bytes())).bytes(), log_.bytes()));
}

TEST_F(OpenedLogTest, FindsALogThatWasCompressedMeanwhile) {
  const std::string path = Store("a.lcm.zst", Compressed());
  const OpenedLog content(PathOf("a.lcm"));
  EXPECT_EQ(content.problem(), "");
  EXPECT_EQ(content.path(), path);
  EXPECT_TRUE(std::ranges::equal(content.bytes(), log_.bytes()));
  EXPECT_THAT(OpenedLog(PathOf("b.lcm")).problem(), StartsWith(PathOf("b.lcm") + ": No such file"));
}

TEST_F(OpenedLogTest, LeavesNoFile) {
  const TemporaryFolder temporary;
  SetTemporaryFolder(temporary.path());
  const OpenedLog content(Store("a.lcm.zst", Compressed()));
  ASSERT_TRUE(std::ranges::equal(content.bytes(), log_.bytes()));
  EXPECT_TRUE(std::filesystem::is_empty(temporary.path()));
}

TEST_F(OpenedLogTest, UsesTheFolderThatIsGiven) {
  const std::string path = Store("a.lcm.zst", Compressed());
  SetTemporaryFolder(PathOf("nowhere"));
  EXPECT_TRUE(std::ranges::equal(OpenedLog(path, {}, folder_.path()).bytes(), log_.bytes()));
  EXPECT_THAT(OpenedLog(path, {}, PathOf("elsewhere")).problem(), HasSubstr(PathOf("elsewhere") + ": No such"));
}

TEST_F(OpenedLogTest, ReportsAFolderThatCannotBeUsed) {
  SetTemporaryFolder(PathOf("nowhere"));
  std::vector<std::uint8_t> file = Compressed();
  const std::string path = Store("a.lcm.zst", file);
  EXPECT_EQ(OpenedLog(path).problem(), path + " cannot be decompressed: " + PathOf("nowhere") +
                                           ": No such file or directory: set TMPDIR to a folder with enough space");
  const auto summary = EncodeSummary({.bytes = 1'234, .first_utime = 0, .last_utime = 0});
  file.insert(file.end(), summary.begin(), summary.end());
  EXPECT_THAT(OpenedLog(Store("b.lcm.zst", file)).problem(), HasSubstr("; it needs 1234 bytes there"));
}

TEST_F(OpenedLogTest, ADamagedFileIsReadAsFarAsPossible) {
  std::vector<std::uint8_t> file = Compressed();
  const std::size_t size = file.size();
  file.resize(size - 3);
  const OpenedLog cut(Store("a.lcm.zst", file));
  EXPECT_EQ(cut.problem(), "");
  EXPECT_THAT(cut.damage(), HasSubstr("a.lcm.zst: "));
  EXPECT_THAT(cut.damage(), HasSubstr("are damaged: a part of the log is missing"));
  EXPECT_GT(cut.bytes().size(), 300'000U);
  file = Compressed();
  file[0] ^= 1U;
  const OpenedLog begun(Store("b.lcm.zst", file));
  EXPECT_THAT(begun.damage(), HasSubstr("in 1 place, the first at byte 0,"));
  EXPECT_EQ(begun.bytes().size(), log_.bytes().size() - 100'000);
}

TEST_F(OpenedLogTest, SomethingElseIsNoLog) {
  EXPECT_THAT(OpenedLog(Store("a.lcm.zst", std::vector<std::uint8_t>(100, 7))).problem(),
              HasSubstr("contains nothing that can be decompressed"));
  const OpenedLog empty(Store("b.lcm.zst", {}));
  EXPECT_EQ(empty.problem(), "");
  EXPECT_TRUE(empty.bytes().empty());
}

TEST_F(OpenedLogTest, ReportsTheProgress) {
  std::size_t last = 0;
  const OpenedLog content(Store("a.lcm.zst", Compressed()), [&](std::size_t done, std::size_t total) {
    EXPECT_GE(done, last);
    EXPECT_EQ(total, Compressed().size());
    last = done;
  });
  EXPECT_EQ(last, content.file_bytes());
}

TEST_F(OpenedLogTest, ReportsWhenTheFileIsCutMeanwhile) {
  const std::string path = Store("a.lcm.zst", Compressed());
  const OpenedLog content(path);
  std::filesystem::resize_file(path, 10);
  EXPECT_THAT(content.Loss(), HasSubstr("was made shorter"));
  EXPECT_TRUE(std::ranges::equal(content.bytes(), log_.bytes()));
}

}  // namespace
}  // namespace axlecast
