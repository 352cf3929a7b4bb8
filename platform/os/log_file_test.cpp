#include "platform/os/log_file.h"

#include <gtest/gtest.h>
#include <sys/stat.h>

#include <cerrno>
#include <fstream>
#include <iterator>
#include <string>

#include "tests/support/temporary_folder.h"

namespace axlecast {
namespace {

std::string ContentOf(const std::string& path) {
  std::ifstream file(path, std::ios::binary);
  return {std::istreambuf_iterator<char>(file), {}};
}

std::int64_t BytesOnDisk(const std::string& path) {
  struct stat status {};
  EXPECT_EQ(stat(path.c_str(), &status), 0);
  return std::int64_t{status.st_blocks} * 512;
}

int WriteText(LogFile& file, const std::string& text) {
  Bytes bytes(reinterpret_cast<const std::uint8_t*>(text.data()), text.size());
  const int result = file.Write(bytes);
  EXPECT_TRUE(result != 0 || bytes.empty());
  return result;
}

class LogFileTest : public ::testing::Test {
 protected:
  TemporaryFolder folder_;
  std::string path_ = folder_.path() + "/a.lcm";
  LogFile file_;
};

TEST_F(LogFileTest, ReservesRoomThatReadersDoNotSeeAndGivesItBack) {
  ASSERT_EQ(file_.Create(path_), 0);
  ASSERT_EQ(WriteText(file_, "one"), 0);
  ASSERT_EQ(WriteText(file_, "two"), 0);
  EXPECT_EQ(ContentOf(path_), "onetwo");
  EXPECT_GT(BytesOnDisk(path_), 1 << 20) << "this file system reserves nothing";
  EXPECT_GT(file_.FreeBytes(), 0);
  EXPECT_EQ(file_.Sync(), 0);
  EXPECT_EQ(file_.Close(), 0);
  EXPECT_FALSE(file_.is_open());
  EXPECT_EQ(ContentOf(path_), "onetwo");
  EXPECT_LE(BytesOnDisk(path_), 1 << 16);
}

TEST_F(LogFileTest, NeverReplacesAFile) {
  ASSERT_EQ(file_.Create(path_), 0);
  LogFile other;
  EXPECT_EQ(other.Create(path_), EEXIST);
  EXPECT_FALSE(other.is_open());
  EXPECT_EQ(other.Create(folder_.path() + "/none/a.lcm"), ENOENT);
}

TEST_F(LogFileTest, GoesOnBehindWhatIsKept) {
  ASSERT_EQ(file_.Create(path_), 0);
  ASSERT_EQ(WriteText(file_, "one and a torn tail"), 0);
  ASSERT_EQ(file_.Close(), 0);
  LogFile again;
  ASSERT_EQ(again.Continue(path_, 3), 0);
  EXPECT_EQ(again.size(), 3);
  ASSERT_EQ(WriteText(again, "two"), 0);
  EXPECT_EQ(ContentOf(path_), "onetwo");
  ASSERT_EQ(again.CutTo(4), 0);
  EXPECT_EQ(ContentOf(path_), "onet");
}

TEST(LogFile, AFullDiskIsToldWithWhatWasWritten) {
  LogFile file;
  ASSERT_EQ(file.Continue("/dev/full", 0), EINVAL) << "a device cannot be cut";
  const std::string text = "x";
  Bytes bytes(reinterpret_cast<const std::uint8_t*>(text.data()), text.size());
  EXPECT_EQ(file.Write(bytes), ENOSPC);
  EXPECT_EQ(bytes.size(), 1U);
  EXPECT_EQ(file.size(), 0);
}

}  // namespace
}  // namespace axlecast
