#include "platform/os/secret_file.h"

#include <fcntl.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cstdlib>
#include <filesystem>

#include "core/base/result.h"
#include "platform/os/descriptor.h"
#include "tests/support/temporary_folder.h"

namespace axlecast {
namespace {

using ::testing::AllOf;
using ::testing::HasSubstr;
using ::testing::Not;

constexpr const char* kContent = "tr0ub4dor";

class SecretFilesTest : public ::testing::Test {
 protected:
  SecretFilesTest() { file_ = directory_ + "/password"; }
  ~SecretFilesTest() override { unsetenv("CREDENTIALS_DIRECTORY"); }

  static void Put(const std::string& path, std::string_view content, mode_t mode) {
    std::filesystem::remove(path);
    const Descriptor file(open(path.c_str(), O_CREAT | O_EXCL | O_WRONLY | O_CLOEXEC, 0600));
    ASSERT_EQ(write(file.get(), content.data(), content.size()), static_cast<ssize_t>(content.size()));
    ASSERT_EQ(fchmod(file.get(), mode), 0);
  }
  // Reads the secret into secret_ and returns the error.
  std::string Read(const SecretPlace& place) {
    Result<Secret> read = files_.Read(place);
    std::string error = ErrorText(read);
    if (read) secret_ = std::move(*read);
    return error;
  }
  std::string ReadFile() { return Read({.file = file_, .credential = {}}); }
  std::string ReadCredential(const std::string& name) { return Read({.file = {}, .credential = name}); }

  const TemporaryFolder folder_;
  const std::string directory_ = folder_.path();
  std::string file_;
  SecretFiles files_;
  Secret secret_;
};

TEST_F(SecretFilesTest, TheContentWithoutItsLastNewline) {
  for (const auto& [content, secret] : {std::pair<std::string_view, std::string_view>{"abcd", "abcd"},
                                        {"abcd\n", "abcd"},
                                        {"abcd\n\n", "abcd\n"},
                                        {" a b\t\n", " a b\t"},
                                        {"x", "x"}}) {
    Put(file_, content, 0600);
    EXPECT_EQ(ReadFile(), "");
    EXPECT_EQ(secret_.text(), secret);
  }
  Put(file_, "read only\n", 0400);
  EXPECT_EQ(ReadFile(), "");
  EXPECT_EQ(secret_.text(), "read only");
}

TEST_F(SecretFilesTest, AFileThatOthersCanUseIsRefused) {
  for (const mode_t mode : {0640U, 0604U, 0660U, 0601U, 0620U, 0644U, 0610U, 0602U}) {
    Put(file_, kContent, mode);
    EXPECT_THAT(ReadFile(),
                AllOf(HasSubstr(file_), HasSubstr("chmod 600 '" + file_ + "'"), Not(HasSubstr(kContent))))
        << std::oct << mode;
    EXPECT_EQ(secret_.text(), "");
  }
}

TEST_F(SecretFilesTest, ItsGroupMayReadWhereThePlaceSaysSo) {
  const SecretPlace place{.file = file_, .credential = {}, .group_may_read = true};
  for (const mode_t mode : {0640U, 0440U, 0600U, 0400U}) {
    Put(file_, kContent, mode);
    EXPECT_EQ(Read(place), "") << std::oct << mode;
    EXPECT_EQ(secret_.text(), kContent);
  }
  for (const mode_t mode : {0644U, 0660U, 0650U, 0604U, 0641U, 0602U}) {
    Put(file_, kContent, mode);
    EXPECT_THAT(Read(place), HasSubstr("is open to other users: chmod 640 '" + file_ + "'")) << std::oct << mode;
  }
}

TEST_F(SecretFilesTest, AFileOfSomebodyElseIsRefused) {
  if (geteuid() != 0) GTEST_SKIP() << "only root can give a file away";
  Put(file_, kContent, 0600);
  ASSERT_EQ(chown(file_.c_str(), 12345, 0), 0);
  EXPECT_THAT(ReadFile(), AllOf(HasSubstr("belongs to user 12345"), HasSubstr("chown"), Not(HasSubstr(kContent))));
}

TEST_F(SecretFilesTest, OnlyRegularFiles) {
  EXPECT_THAT(ReadFile(), HasSubstr("does not exist"));
  file_ = directory_;
  EXPECT_THAT(ReadFile(), HasSubstr("no regular file"));
  file_ = "/dev/zero";
  EXPECT_THAT(ReadFile(), HasSubstr("no regular file"));
  file_ = directory_ + "/fifo";
  ASSERT_EQ(mkfifo(file_.c_str(), 0600), 0);
  EXPECT_THAT(ReadFile(), HasSubstr("no regular file")) << "and it does not wait for a writer";
}

TEST_F(SecretFilesTest, UpTo4KiBOfTextWithoutNul) {
  Put(file_, std::string(4096, 'x'), 0600);
  EXPECT_EQ(ReadFile(), "");
  EXPECT_EQ(secret_.text(), std::string(4096, 'x'));
  Put(file_, std::string(4097, 'x'), 0600);
  EXPECT_THAT(ReadFile(), AllOf(HasSubstr("more than 4096 bytes"), Not(HasSubstr("xxxxxxxxxx"))));
  Put(file_, std::string_view("tr0ub4dor\0x", 11), 0600);
  EXPECT_THAT(ReadFile(), AllOf(HasSubstr("NUL"), Not(HasSubstr(kContent))));
  Put(file_, "", 0600);
  EXPECT_THAT(ReadFile(), HasSubstr("is empty"));
  Put(file_, "\n", 0600);
  EXPECT_THAT(ReadFile(), HasSubstr("is empty"));
}

TEST_F(SecretFilesTest, CredentialsAsSystemdPassesThem) {
  EXPECT_THAT(ReadCredential("gm3"), HasSubstr("LoadCredential=gm3:PATH"));
  ASSERT_EQ(setenv("CREDENTIALS_DIRECTORY", directory_.c_str(), 1), 0);
  EXPECT_THAT(ReadCredential("gm3"), HasSubstr("does not exist"));
  // 0440 is how mode 0400 shows with the ACL by which systemd opens it to the unit's user.
  for (const mode_t mode : {0400U, 0440U}) {
    Put(directory_ + "/gm3", "from systemd\n", mode);
    EXPECT_EQ(ReadCredential("gm3"), "");
    EXPECT_EQ(secret_.text(), "from systemd");
  }
  for (const mode_t mode : {0444U, 0460U, 0402U}) {
    Put(directory_ + "/gm3", kContent, mode);
    EXPECT_THAT(ReadCredential("gm3"), AllOf(HasSubstr("open to other users"), Not(HasSubstr(kContent))));
  }
  for (const char* name : {"../gm3", "a/b", "/etc/shadow", ".", ".."}) {
    EXPECT_THAT(ReadCredential(name), HasSubstr("is no name of one")) << name;
  }
}

TEST_F(SecretFilesTest, NoPlaceIsAMistakeOfTheConfiguration) {
  EXPECT_THAT(Read({}), HasSubstr("name a file or a credential"));
}

}  // namespace
}  // namespace axlecast
