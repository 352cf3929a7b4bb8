#include "platform/os/folder.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <string>

#include "core/base/result.h"
#include "tests/support/temporary_folder.h"

namespace axlecast {
namespace {

using ::testing::HasSubstr;

class RunDirectoryTest : public ::testing::Test {
 protected:
  static mode_t Mode(const std::string& path) {
    struct stat status {};
    return stat(path.c_str(), &status) == 0 ? status.st_mode & 07777 : 0;
  }

  const TemporaryFolder folder_;
  const std::string root_ = folder_.path();
};

TEST_F(RunDirectoryTest, MakesWhatIsMissingForThisUserOnly) {
  EXPECT_EQ(ErrorText(PrepareRunDirectory(root_ + "/a/press3")), "");
  EXPECT_EQ(Mode(root_ + "/a"), 0700U);
  EXPECT_EQ(Mode(root_ + "/a/press3"), 0700U);
  EXPECT_EQ(ErrorText(PrepareRunDirectory(root_ + "/a/press3")), "") << "again";
}

TEST_F(RunDirectoryTest, ClosesWhatStandsOpen) {
  std::filesystem::create_directory(root_ + "/press3");
  std::filesystem::permissions(root_ + "/press3", std::filesystem::perms::all);
  EXPECT_EQ(ErrorText(PrepareRunDirectory(root_ + "/press3")), "");
  EXPECT_EQ(Mode(root_ + "/press3"), 0700U);
}

TEST_F(RunDirectoryTest, ALinkOrAFileInItsPlaceIsRefused) {
  std::filesystem::create_directory(root_ + "/elsewhere");
  std::filesystem::create_symlink(root_ + "/elsewhere", root_ + "/press3");
  EXPECT_THAT(ErrorText(PrepareRunDirectory(root_ + "/press3")), HasSubstr("AXLECAST_RUN_DIR"));
  std::ofstream(root_ + "/file") << "x";
  EXPECT_NE(ErrorText(PrepareRunDirectory(root_ + "/file")), "");
  EXPECT_NE(ErrorText(PrepareRunDirectory(root_ + "/file/press3")), "");
}

TEST_F(RunDirectoryTest, WhereOthersMayWriteALinkOnTheWayIsRefused) {
  std::filesystem::create_directory(root_ + "/tmp");
  std::filesystem::permissions(root_ + "/tmp", std::filesystem::perms::all | std::filesystem::perms::sticky_bit);
  std::filesystem::create_directory(root_ + "/trap");
  std::filesystem::create_symlink(root_ + "/trap", root_ + "/tmp/axlecast-0");
  EXPECT_THAT(ErrorText(PrepareRunDirectory(root_ + "/tmp/axlecast-0/press3")),
              HasSubstr("is no directory (a link?)"));
}

TEST_F(RunDirectoryTest, AnothersDirectoryIsRefused) {
  if (geteuid() != 0) GTEST_SKIP() << "only root can make one";
  std::filesystem::create_directory(root_ + "/press3");
  ASSERT_EQ(chown((root_ + "/press3").c_str(), 12345, 12345), 0);
  EXPECT_THAT(ErrorText(PrepareRunDirectory(root_ + "/press3")), HasSubstr("belongs to user 12345"));
}

TEST_F(RunDirectoryTest, ALockIsHeldOnceAndNamesItsHolder) {
  const std::string path = root_ + "/rs485-0.lock";
  LockFile first;
  LockFile second;
  EXPECT_EQ(ErrorText(first.Acquire(path)), "");
  EXPECT_THAT(ErrorText(second.Acquire(path)), HasSubstr("is held by process " + std::to_string(getpid())));
  first.Release();
  EXPECT_EQ(ErrorText(second.Acquire(path)), "");
  EXPECT_NE(ErrorText(LockFile().Acquire(root_ + "/missing/lock")), "");
}

using ::testing::HasSubstr;
using ::testing::StartsWith;

class ForeignLink : public ::testing::Test {
 protected:
  static void GiveAway(const std::string& link) { ASSERT_EQ(lchown(link.c_str(), 12'345, 12'345), 0); }

  TemporaryFolder folder_;
  const std::string path_ = folder_.path();
};

TEST_F(ForeignLink, OwnLinksAndThoseOfRootAreFollowed) {
  std::filesystem::create_directory(path_ + "/real");
  std::filesystem::create_symlink("real", path_ + "/own");
  std::filesystem::create_symlink("../own/./x/..", path_ + "/real/back");
  EXPECT_EQ(ErrorText(CheckLinks(path_ + "/own/journal.db")), "");
  EXPECT_EQ(ErrorText(CheckLinks(path_ + "/real/back/journal.db")), "");
  EXPECT_EQ(ErrorText(CheckLinks("/proc/self/journal.db")), "");
  EXPECT_EQ(ErrorText(CheckLinks(path_ + "/nowhere/journal.db")), "");
}

TEST_F(ForeignLink, LinksOfOthersAreNotFollowed) {
  if (geteuid() != 0) return;  // has no other users
  std::filesystem::create_directory(path_ + "/real");
  std::filesystem::create_symlink("real", path_ + "/theirs");
  std::filesystem::create_symlink(path_ + "/theirs", path_ + "/own");
  GiveAway(path_ + "/theirs");
  EXPECT_THAT(ErrorText(CheckLinks(path_ + "/theirs/journal.db")),
              StartsWith(path_ + "/theirs is a symbolic link of user 12345"));
  EXPECT_THAT(ErrorText(CheckLinks(path_ + "/own/journal.db")), HasSubstr("/theirs is a symbolic link"));
  std::filesystem::create_symlink("nowhere.db", path_ + "/real/journal.db");
  GiveAway(path_ + "/real/journal.db");
  EXPECT_THAT(ErrorText(CheckLinks(path_ + "/real/journal.db")), HasSubstr("/real/journal.db is a symbolic link"))
      << "also where it leads to nothing yet";
}

TEST_F(ForeignLink, ALinkToItselfEnds) {
  std::filesystem::create_symlink("loop", path_ + "/loop");
  EXPECT_THAT(ErrorText(CheckLinks(path_ + "/loop/journal.db")), HasSubstr("symbolic links"));
}

}  // namespace

}  // namespace axlecast
