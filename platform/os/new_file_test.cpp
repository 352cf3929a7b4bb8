#include "platform/os/new_file.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/stat.h>
#include <unistd.h>

#include <filesystem>
#include <fstream>
#include <iterator>

#include "core/base/result.h"
#include "tests/support/temporary_folder.h"

namespace axlecast {
namespace {

using ::testing::HasSubstr;

class NewFileTest : public ::testing::Test {
 protected:
  [[nodiscard]] std::string Content() const {
    std::ifstream file(path_, std::ios::binary);
    return {std::istreambuf_iterator<char>(file), {}};
  }
  [[nodiscard]] mode_t Mode() const {
    struct stat status {};
    EXPECT_EQ(stat(path_.c_str(), &status), 0);
    return status.st_mode & 07777U;
  }
  [[nodiscard]] auto FilesThere() const {
    return std::distance(std::filesystem::directory_iterator(folder_.path()), {});
  }

  const TemporaryFolder folder_;
  const std::string path_ = folder_.path() + "/a.key";
};

TEST_F(NewFileTest, HasItsContentAndItsModeWhateverTheUmask) {
  for (const mode_t mask : {0U, 0777U}) {
    std::filesystem::remove(path_);
    const mode_t before = umask(mask);
    const std::string problem = ErrorText(WriteNewFile(path_, "content\n", {}, false));
    umask(before);
    EXPECT_EQ(problem, "");
    EXPECT_EQ(Content(), "content\n");
    EXPECT_EQ(Mode(), 0600U);
    EXPECT_EQ(FilesThere(), 1);
  }
}

TEST_F(NewFileTest, ForAGroup) {
  const gid_t group = getegid();
  EXPECT_EQ(ErrorText(WriteNewFile(path_, "content\n", {.mode = 0640, .group = group}, false)), "");
  EXPECT_EQ(Mode(), 0640U);
  struct stat status {};
  ASSERT_EQ(stat(path_.c_str(), &status), 0);
  EXPECT_EQ(status.st_gid, group);
}

TEST_F(NewFileTest, OneThatIsThereStaysUnlessItIsToBeReplaced) {
  ASSERT_EQ(ErrorText(WriteNewFile(path_, "first", {}, false)), "");
  EXPECT_EQ(ErrorText(WriteNewFile(path_, "second", {}, false)), path_ + " exists already, and is not replaced");
  EXPECT_EQ(Content(), "first");
  EXPECT_EQ(FilesThere(), 1);
  EXPECT_EQ(ErrorText(WriteNewFile(path_, "second", {}, true)), "");
  EXPECT_EQ(Content(), "second");
  EXPECT_EQ(FilesThere(), 1);
}

TEST_F(NewFileTest, ALinkOfThatNameIsNotFollowed) {
  std::filesystem::create_symlink(folder_.path() + "/elsewhere", path_);
  EXPECT_THAT(ErrorText(WriteNewFile(path_, "content", {}, false)), HasSubstr("exists already"));
  EXPECT_EQ(ErrorText(WriteNewFile(path_, "content", {}, true)), "");
  EXPECT_FALSE(std::filesystem::is_symlink(path_));
  EXPECT_FALSE(std::filesystem::exists(folder_.path() + "/elsewhere"));
}

TEST_F(NewFileTest, WhereItCannotBeTheCauseIsNamed) {
  EXPECT_EQ(ErrorText(WriteNewFile(folder_.path() + "/no/a.key", "x", {}, false)),
            folder_.path() + "/no/a.key: No such file or directory");
  std::filesystem::create_directory(path_);
  EXPECT_THAT(ErrorText(WriteNewFile(path_, "x", {}, true)), HasSubstr("Is a directory"));
  EXPECT_EQ(FilesThere(), 1);
}

TEST(FindGroup, KnowsThoseOfTheSystem) {
  EXPECT_EQ(FindGroup("root"), gid_t{0});
  EXPECT_EQ(FindGroup("no-such-group"), std::nullopt);
}

TEST_F(NewFileTest, InPiecesStandsInItsPlaceOnlyWhenItIsWhole) {
  {
    NewFile file(path_, {});
    EXPECT_EQ(ErrorText(file.Append("one ")), "");
    EXPECT_EQ(ErrorText(file.Append("two")), "");
    EXPECT_FALSE(std::filesystem::exists(path_));
    EXPECT_EQ(ErrorText(file.Commit(false)), "");
  }
  EXPECT_EQ(Content(), "one two");
  EXPECT_EQ(FilesThere(), 1);
}

TEST_F(NewFileTest, CollectedPiecesAreWrittenInOrder) {
  const std::string piece(300'000, 'x');
  {
    NewFile file(path_, {});
    for (int i = 0; i < 8; ++i) EXPECT_TRUE(file.Collect(piece + std::to_string(i)));
    EXPECT_EQ(ErrorText(file.Commit(false)), "");
  }
  std::string expected;
  for (int i = 0; i < 8; ++i) expected += piece + std::to_string(i);
  EXPECT_EQ(Content(), expected);
  NewFile none(folder_.path() + "/none/file", {});
  EXPECT_FALSE(none.Collect("x"));
  EXPECT_THAT(none.Commit(false).error().text, HasSubstr("No such file"));
}

TEST_F(NewFileTest, GivenUpLeavesNothing) {
  {
    NewFile file(path_, {});
    EXPECT_EQ(ErrorText(file.Append("content")), "");
  }
  EXPECT_EQ(FilesThere(), 0);
}

TEST_F(NewFileTest, KeepsWhatItReplacesUnderAnotherName) {
  const std::string kept = path_ + ".old";
  ASSERT_EQ(ErrorText(WriteNewFile(path_, "old", {}, false)), "");
  for (const bool free : {true, false}) {
    NewFile file(path_, {});
    EXPECT_EQ(ErrorText(file.Append(free ? "new" : "newer")), "");
    const std::string problem = ErrorText(file.Commit(true, kept));
    if (free) {
      EXPECT_EQ(problem, "");
    } else {
      EXPECT_THAT(problem, HasSubstr(kept + ": File exists"));
    }
    EXPECT_EQ(Content(), "new");
  }
  std::ifstream old(kept);
  EXPECT_EQ(std::string(std::istreambuf_iterator<char>(old), {}), "old");
  EXPECT_EQ(FilesThere(), 2);
}

TEST_F(NewFileTest, AResultReplacesAFileAndGoesWhereALinkOrADeviceLeads) {
  EXPECT_EQ(ErrorText(WriteOutput(path_, "first, longer")), "");
  EXPECT_EQ(ErrorText(WriteOutput(path_, "second")), "");
  EXPECT_EQ(Content(), "second");
  const std::string link = folder_.path() + "/link";
  std::filesystem::create_symlink(path_, link);
  EXPECT_EQ(ErrorText(WriteOutput(link, "third")), "");
  EXPECT_TRUE(std::filesystem::is_symlink(link));
  EXPECT_EQ(Content(), "third");
  EXPECT_EQ(ErrorText(WriteOutput("/dev/null", "gone")), "");
  EXPECT_THAT(ErrorText(WriteOutput("/dev/full", "no room")), HasSubstr("/dev/full: No space left"));
  EXPECT_THAT(ErrorText(WriteOutput(folder_.path(), "a folder")), HasSubstr("Is a directory"));
}

}  // namespace
}  // namespace axlecast
