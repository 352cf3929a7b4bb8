#include "platform/os/foreign_link.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <filesystem>

#include "tests/support/temporary_folder.h"

namespace axlecast {
namespace {

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
  EXPECT_EQ(ForeignLinkProblem(path_ + "/own/journal.db"), "");
  EXPECT_EQ(ForeignLinkProblem(path_ + "/real/back/journal.db"), "");
  EXPECT_EQ(ForeignLinkProblem("/proc/self/journal.db"), "");
  EXPECT_EQ(ForeignLinkProblem(path_ + "/nowhere/journal.db"), "");
}

TEST_F(ForeignLink, LinksOfOthersAreNotFollowed) {
  if (geteuid() != 0) return;  // has no other users
  std::filesystem::create_directory(path_ + "/real");
  std::filesystem::create_symlink("real", path_ + "/theirs");
  std::filesystem::create_symlink(path_ + "/theirs", path_ + "/own");
  GiveAway(path_ + "/theirs");
  EXPECT_THAT(ForeignLinkProblem(path_ + "/theirs/journal.db"),
              StartsWith(path_ + "/theirs is a symbolic link of user 12345"));
  EXPECT_THAT(ForeignLinkProblem(path_ + "/own/journal.db"), HasSubstr("/theirs is a symbolic link"));
  std::filesystem::create_symlink("nowhere.db", path_ + "/real/journal.db");
  GiveAway(path_ + "/real/journal.db");
  EXPECT_THAT(ForeignLinkProblem(path_ + "/real/journal.db"), HasSubstr("/real/journal.db is a symbolic link"))
      << "also where it leads to nothing yet";
}

TEST_F(ForeignLink, ALinkToItselfEnds) {
  std::filesystem::create_symlink("loop", path_ + "/loop");
  EXPECT_THAT(ForeignLinkProblem(path_ + "/loop/journal.db"), HasSubstr("symbolic links"));
}

}  // namespace
}  // namespace axlecast
