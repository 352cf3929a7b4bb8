#include "tools/doctor/host/host.h"

#include <fcntl.h>
#include <gmock/gmock.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <sys/sysmacros.h>
#include <unistd.h>

#include <cerrno>
#include <filesystem>
#include <fstream>

#include "platform/os/descriptor.h"
#include "platform/os/folder.h"
#include "tests/support/temporary_folder.h"

namespace axlecast {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;

class HostFilesTest : public testing::Test {
 protected:
  void Put(const std::string& path, const std::string& text) {
    std::filesystem::create_directories(std::filesystem::path(root_ + path).parent_path());
    std::ofstream(root_ + path) << text;
  }
  std::string Content(const std::string& path) { return HostFiles(root_).Text(path).value_or("none"); }

  TemporaryFolder folder_;
  const std::string root_ = folder_.path();
};

TEST_F(HostFilesTest, TextAndNumbersAreReadBelowTheRoot) {
  Put("/proc/sys/a", "212992\n");
  Put("/proc/sys/b", "12 kB\n");
  const HostFiles files(root_);
  EXPECT_EQ(files.Text("/proc/sys/a"), "212992");
  EXPECT_EQ(files.Number("/proc/sys/a"), 212992);
  EXPECT_EQ(files.Number("/proc/sys/b"), std::nullopt);
  EXPECT_EQ(files.Number("/proc/sys/c"), std::nullopt);
  EXPECT_EQ(files.Text("/proc"), std::nullopt) << "a folder has no text";
  EXPECT_THAT(files.Names("/proc/sys"), ElementsAre("a", "b"));
  EXPECT_THAT(files.Names("/nothing"), IsEmpty());
}

TEST_F(HostFilesTest, APathIsLookedAtAsItIs) {
  Put("/key", "x");
  ASSERT_EQ(chmod((root_ + "/key").c_str(), 0640), 0);
  const HostFile key = HostFiles(root_).Look("/key");
  EXPECT_EQ(key.kind, HostFile::Kind::kRegular);
  EXPECT_EQ(key.mode, mode_t{0640});
  EXPECT_EQ(key.uid, geteuid());
  EXPECT_TRUE(key.readable && key.writable);
  EXPECT_EQ(HostFiles(root_).Look("/none").error, ENOENT);
  const HostFile null = HostFiles().Look("/dev/null");
  EXPECT_EQ(null.kind, HostFile::Kind::kCharacter);
  EXPECT_EQ(null.major * 10 + null.minor, 13U);
}

// The kernel's line for a lock (proc(5)), and a process with a name.
TEST_F(HostFilesTest, WhoLocksADeviceHoldsIt) {
  std::filesystem::create_directories(root_ + "/dev");
  std::filesystem::create_symlink("/dev/null", root_ + "/dev/port");
  struct stat status {};
  ASSERT_EQ(stat("/dev/null", &status), 0);
  std::array<char, 64> file{};
  std::snprintf(file.data(), file.size(), "%02x:%02x:%lu", major(status.st_dev), minor(status.st_dev),
                status.st_ino);
  Put("/proc/77/comm", "minicom\n");
  Put("/proc/77/cmdline", std::string("minicom\0-D\0", 11));
  Put("/proc/78/comm", "other\n");
  Put("/proc/locks", "1: FLOCK  ADVISORY  WRITE 77 " + std::string(file.data()) +
                         " 0 EOF\n1: -> FLOCK  ADVISORY  WRITE 78 " + file.data() +
                         " 0 EOF\n2: POSIX  ADVISORY  READ 78 00:01:1 0 EOF\nnonsense\n");
  const HostFiles files(root_);
  EXPECT_EQ(files.Processes().size(), 2U);
  const std::vector<HostProcess> holders = files.Holders("/dev/port");
  ASSERT_EQ(holders.size(), 1U);
  EXPECT_EQ(holders[0].id, 77);
  EXPECT_EQ(holders[0].name, "minicom");
  EXPECT_THAT(holders[0].words, ElementsAre("minicom", "-D"));
  EXPECT_THAT(files.Holders("/dev/none"), IsEmpty());
}

TEST_F(HostFilesTest, ALineIsAddedOnce) {
  const std::string path = root_ + "/etc/sysctl.d/60-axlecast.conf";
  EXPECT_TRUE(AppendLine(path, "a = 1"));
  EXPECT_TRUE(AppendLine(path, "b = 2"));
  EXPECT_TRUE(AppendLine(path, "a = 1"));
  EXPECT_EQ(Content("/etc/sysctl.d/60-axlecast.conf"), "a = 1\nb = 2");
  std::ofstream(path) << "no end of line";
  EXPECT_TRUE(AppendLine(path, "c = 3"));
  EXPECT_EQ(Content("/etc/sysctl.d/60-axlecast.conf"), "no end of line\nc = 3");
  EXPECT_THAT(AppendLine(path + "/x", "a").error().text, HasSubstr("60-axlecast.conf"));
}

TEST_F(HostFilesTest, AValueIsWrittenWhereThereIsAFile) {
  Put("/sys/x", "16\n");
  EXPECT_TRUE(WriteValue(root_ + "/sys/x", "1"));
  EXPECT_EQ(Content("/sys/x"), "1");
  EXPECT_THAT(WriteValue(root_ + "/sys/y", "1").error().text, HasSubstr("No such file"));
}

TEST(RunProgram, SaysWhatTheProgramSaid) {
  EXPECT_EQ(*RunProgram("echo 'a b'"), "a b\n");
  EXPECT_TRUE(RunProgram("true"));
  EXPECT_THAT(RunProgram("sh -c 'echo why >&2; exit 3'").error().text, HasSubstr("why"));
  EXPECT_EQ(RunProgram("false").error().text, "false failed");
  EXPECT_EQ(RunProgram("axlecast-no-such-program").error().text, "axlecast-no-such-program is not installed");
}

TEST_F(HostFilesTest, AFolderIsJudgedByTheNearestThatIsThere) {
  const HostFolder folder = LookAtFolder(root_ + "/a/b");
  EXPECT_EQ(folder.existing, root_);
  EXPECT_TRUE(folder.is_folder && folder.writable);
  EXPECT_GT(folder.free_bytes, 0);
  Put("/file", "");
  EXPECT_FALSE(LookAtFolder(root_ + "/file/logs").is_folder);
  EXPECT_EQ(LookAtFolder("/dev/shm/x").file_system, "tmpfs");
}

}  // namespace
}  // namespace axlecast
