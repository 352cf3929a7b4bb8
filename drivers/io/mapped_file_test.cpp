#include "drivers/io/mapped_file.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/stat.h>
#include <unistd.h>

#include <fstream>
#include <utility>

#include "tests/support/temporary_folder.h"

namespace axlecast {
namespace {

using testing::ElementsAre;
using testing::EndsWith;
using testing::HasSubstr;
using testing::IsEmpty;

class MappedFileTest : public testing::Test {
 protected:
  [[nodiscard]] std::string Write(const std::string& content) const {
    const std::string path = folder_.path() + "/file";
    std::ofstream(path, std::ios::binary) << content;
    return path;
  }
  const TemporaryFolder folder_;
};

TEST_F(MappedFileTest, ShowsTheContent) {
  const std::string path = Write("abc");
  ASSERT_EQ(chmod(path.c_str(), 0640), 0);
  const MappedFile file(path);
  EXPECT_EQ(file.problem(), "");
  EXPECT_THAT(file.bytes(), ElementsAre('a', 'b', 'c'));
  EXPECT_EQ(file.mode(), 0640U);
}

TEST_F(MappedFileTest, TellsWhatAFileInItsPlaceMustHave) {
  const std::string path = Write("abc");
  ASSERT_EQ(chmod(path.c_str(), 0604), 0);
  const bool root = geteuid() == 0;
  if (root) {
    ASSERT_EQ(chown(path.c_str(), 1'234, 5'678), 0);
  }
  const FileAccess access = MappedFile(path).access();
  EXPECT_EQ(WriteNewFile(path, "new", access, true), "");
  struct stat status {};
  ASSERT_EQ(stat(path.c_str(), &status), 0);
  EXPECT_EQ(status.st_mode & 0777U, 0604U);
  EXPECT_EQ(status.st_uid, root ? 1'234U : geteuid());
  EXPECT_EQ(status.st_gid, root ? 5'678U : getegid());
}

TEST_F(MappedFileTest, CanBeMoved) {
  MappedFile file(Write("abc"));
  MappedFile other(folder_.path() + "/none");
  other = std::move(file);
  EXPECT_THAT(other.bytes(), ElementsAre('a', 'b', 'c'));
  const MappedFile third(std::move(other));
  EXPECT_THAT(third.bytes(), ElementsAre('a', 'b', 'c'));
  EXPECT_EQ(third.problem(), "");
}

TEST_F(MappedFileTest, AnEmptyFileIsOne) {
  const MappedFile file(Write(""));
  EXPECT_EQ(file.problem(), "");
  EXPECT_THAT(file.bytes(), IsEmpty());
}

TEST_F(MappedFileTest, WhatCannotBeReadIsNamed) {
  EXPECT_THAT(MappedFile(folder_.path() + "/none").problem(), HasSubstr("/none: No such file"));
  EXPECT_THAT(MappedFile(folder_.path()).problem(), EndsWith(" is a folder, not a file"));
  const std::string pipe = folder_.path() + "/pipe";
  ASSERT_EQ(mkfifo(pipe.c_str(), 0600), 0);
  EXPECT_THAT(MappedFile(pipe).problem(), HasSubstr("no regular file"));
}

}  // namespace
}  // namespace axlecast
