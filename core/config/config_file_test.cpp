#include "core/config/config_file.h"

#include <fcntl.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/socket.h>
#include <sys/stat.h>
#include <unistd.h>

#include <array>
#include <fstream>
#include <string>

#include "tests/support/temporary_folder.h"

namespace axlecast {
namespace {

using ::testing::HasSubstr;

constexpr unsigned kForeignId = 54'321;  // of a user and group that the host does not know

class ConfigFile : public ::testing::Test {
 protected:
  std::string File(mode_t mode) {
    std::ofstream(path_) << "machine: press3\n";
    EXPECT_EQ(chmod(path_.c_str(), mode), 0);
    return path_;
  }

  static std::string ErrorsOf(const std::string& path) { return ErrorText(ReadConfigFile(path)); }

  TemporaryFolder folder_;
  const std::string path_ = folder_.path() + "/m.yaml";
};

TEST_F(ConfigFile, IsReadWhereItsOwnerAloneMayWrite) {
  for (const mode_t mode : {0644U, 0600U, 0440U}) {
    const auto text = ReadConfigFile(File(mode));
    ASSERT_TRUE(text) << text.error().text;
    EXPECT_EQ(*text, "machine: press3\n");
    unlink(path_.c_str());
  }
}

TEST_F(ConfigFile, IsRefusedWhereOthersMayWrite) {
  EXPECT_THAT(ErrorsOf(File(0646)), HasSubstr("can be written by every user: who can write this file decides"));
  EXPECT_THAT(ErrorsOf(File(0666)), HasSubstr("chmod go-w"));
}

TEST_F(ConfigFile, IsRefusedWhereASharedGroupMayWrite) {
  const std::string path = File(0664);
  if (geteuid() != 0) GTEST_SKIP() << "only root can give a file to a group that it is not in";
  ASSERT_EQ(chown(path.c_str(), geteuid(), kForeignId), 0);
  EXPECT_THAT(ErrorsOf(path), HasSubstr("can be written by its group"));
  ASSERT_EQ(chmod(path.c_str(), 0644), 0);
  EXPECT_EQ(ErrorsOf(path), "");
}

// The group of that name and number, which this host does not know, is the owner's own.
TEST_F(ConfigFile, OfAnotherUserIsReadUnlessOthersThanItsOwnerMayWrite) {
  if (geteuid() != 0) GTEST_SKIP() << "only root can give a file away";
  const std::string path = File(0664);
  ASSERT_EQ(chown(path.c_str(), kForeignId, kForeignId), 0);
  EXPECT_EQ(ErrorsOf(path), "");
  ASSERT_EQ(chmod(path.c_str(), 0666), 0);
  EXPECT_THAT(ErrorsOf(path), HasSubstr("can be written by every user"));
}

TEST_F(ConfigFile, AFifoIsRefusedWithoutWaiting) {
  ASSERT_EQ(mkfifo(path_.c_str(), 0600), 0);
  EXPECT_THAT(ErrorsOf(path_), HasSubstr("cannot be read: it is a FIFO (named pipe); name a regular file"));
}

TEST_F(ConfigFile, DevicesAndDirectoriesAreRefused) {
  EXPECT_THAT(ErrorsOf("/dev/zero"), HasSubstr("it is a device"));
  EXPECT_THAT(ErrorsOf("/dev/null"), HasSubstr("it is a device"));
  EXPECT_THAT(ErrorsOf(folder_.path()), HasSubstr("it is a directory"));
}

TEST_F(ConfigFile, OneThatIsMissingIsNamed) {
  EXPECT_EQ(ErrorsOf(path_), "cannot be read: No such file or directory");
}

}  // namespace
}  // namespace axlecast
