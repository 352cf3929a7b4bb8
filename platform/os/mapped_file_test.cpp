#include "platform/os/mapped_file.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/stat.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <csignal>
#include <filesystem>
#include <fstream>
#include <utility>
#include <vector>

#include "core/base/result.h"
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
  EXPECT_EQ(ErrorText(WriteNewFile(path, "new", access, true)), "");
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

constexpr std::size_t kLarge = 200'000;

std::size_t CountOf(Bytes bytes, char c) {
  return static_cast<std::size_t>(std::ranges::count(bytes, static_cast<std::uint8_t>(c)));
}

TEST_F(MappedFileTest, ZerosStandWhereTheFileIsCutWhileItIsRead) {
  for (const std::size_t left : {std::size_t{0}, std::size_t{1}, std::size_t{4'096}, std::size_t{100'000}}) {
    const std::string path = Write(std::string(kLarge, 'x'));
    const MappedFile file(path);
    EXPECT_EQ(CountOf(file.bytes().first(50'000), 'x'), 50'000U);
    EXPECT_EQ(file.Loss(), "");
    std::filesystem::resize_file(path, left);
    EXPECT_EQ(CountOf(file.bytes(), 'x'), left);
    EXPECT_EQ(CountOf(file.bytes(), '\0'), kLarge - left);
    EXPECT_THAT(file.Loss(), HasSubstr("of its 200000 bytes " + std::to_string(left) + " are left"));
  }
}

TEST_F(MappedFileTest, TellsThatItWasWrittenAnewWhileItWasRead) {
  const std::string path = Write(std::string(kLarge, 'x'));
  const MappedFile file(path);
  std::filesystem::resize_file(path, 0);
  EXPECT_EQ(file.bytes()[kLarge - 1], 0);
  std::filesystem::resize_file(path, kLarge);
  EXPECT_THAT(file.Loss(), HasSubstr("could not be read everywhere"));
}

TEST_F(MappedFileTest, OfSeveralThatAreCutEachKnows) {
  std::vector<MappedFile> files;
  for (const char* name : {"/a", "/b", "/c"}) {
    std::ofstream(folder_.path() + name) << std::string(kLarge, 'x');
    files.emplace_back(folder_.path() + name);
  }
  std::filesystem::resize_file(folder_.path() + "/b", 10);
  for (const MappedFile& file : files) static_cast<void>(CountOf(file.bytes(), 'x'));
  EXPECT_EQ(files[0].Loss() + files[2].Loss(), "");
  EXPECT_THAT(files[1].Loss(), HasSubstr("/b was made shorter"));
}

TEST_F(MappedFileTest, GrowthIsNotSeen) {
  const std::string path = Write("abc");
  const MappedFile file(path);
  std::ofstream(path, std::ios::app) << std::string(kLarge, 'x');
  EXPECT_THAT(file.bytes(), ElementsAre('a', 'b', 'c'));
  EXPECT_EQ(file.Loss(), "");
}

TEST_F(MappedFileTest, ABusErrorOfAnythingElseEndsTheProcessAsEver) {
  EXPECT_EXIT(
      {
        const MappedFile file(Write("abc"));
        static_cast<void>(raise(SIGBUS));
      },
      [](int status) { return !WIFEXITED(status) || WEXITSTATUS(status) != 0; }, "");
}

}  // namespace

}  // namespace axlecast
