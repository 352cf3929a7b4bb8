#include "tools/axlecast/common/subcommands.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/stat.h>
#include <unistd.h>

#include <CLI/CLI.hpp>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <nlohmann/json.hpp>

#include "core/command/keys.h"
#include "core/config/load.h"
#include "tests/support/temporary_folder.h"
#include "tools/axlecast/setup/new_keys.h"

namespace axlecast {
namespace {

using ::testing::HasSubstr;
using ::testing::Not;

class KeygenTest : public ::testing::Test {
 protected:
  int Run(const std::string& arguments) {
    CLI::App app("test", "axlecast");
    int exit_code = -1;
    AddKeygenCommand(app, exit_code);
    ::testing::internal::CaptureStdout();
    ::testing::internal::CaptureStderr();
    app.parse("keygen " + arguments);
    out_ = ::testing::internal::GetCapturedStdout();
    err_ = ::testing::internal::GetCapturedStderr();
    return exit_code;
  }
  static std::string Content(const std::string& file) {
    std::ifstream stream(file, std::ios::binary);
    return {std::istreambuf_iterator<char>(stream), {}};
  }
  static mode_t Mode(const std::string& file) {
    struct stat status {};
    EXPECT_EQ(stat(file.c_str(), &status), 0) << file;
    return status.st_mode & 07777U;
  }
  static std::string PublicIn(const std::string& file) {
    const auto key = SigningKey::Parse(Content(file));
    return key ? KeyText(key->public_key()) : "no key";
  }
  // The secret half of a file, as text.
  static std::string SeedIn(const std::string& file) { return Content(file).substr(15, 64); }

  const TemporaryFolder folder_;
  const std::string file_ = folder_.path() + "/anna.key";
  const std::string machine_ = folder_.path() + "/press3";
  std::string out_;
  std::string err_;
};

TEST_F(KeygenTest, WritesAKeyThatOnlyItsOwnerCanRead) {
  EXPECT_EQ(Run(file_ + " --role maintainer"), 0);
  EXPECT_EQ(Mode(file_), 0600U);
  const std::string key = PublicIn(file_);
  ASSERT_TRUE(ParsePublicKey(key));
  EXPECT_EQ(out_, file_ + "\n    public key  " + key + "\n    key id      " + KeyIdText(*ParsePublicKey(key)) +
                      "\nIn the machine's file, below bridge: keys:\n\n    anna: {public: " + key +
                      ", role: maintainer, file: " + file_ + "}\n");
  EXPECT_EQ(err_, "");
  EXPECT_THAT(out_, Not(HasSubstr(SeedIn(file_))));
}

TEST_F(KeygenTest, MakesTheFolderOfAKeyWhereItIsMissing) {
  EXPECT_EQ(Run(machine_ + "/deeper/anna.key"), 0);
  EXPECT_EQ(Mode(machine_ + "/deeper/anna.key"), 0600U);
  EXPECT_EQ(Run(file_ + " --json"), 0);
  EXPECT_EQ(Run(file_ + "/bob.key"), 1) << "a file is no folder";
  EXPECT_THAT(err_, HasSubstr(file_));
}

TEST_F(KeygenTest, AKeyThatIsThereStaysUnlessForced) {
  ASSERT_EQ(Run(file_), 0);
  const std::string first = Content(file_);
  EXPECT_EQ(Run(file_), 1);
  EXPECT_THAT(err_, HasSubstr(file_ + " exists already: --show prints its public half; --force replaces it"));
  EXPECT_EQ(out_, "");
  EXPECT_EQ(Content(file_), first);
  EXPECT_EQ(Run(file_ + " --force"), 0);
  EXPECT_NE(Content(file_), first);
}

TEST_F(KeygenTest, ShowPrintsThePublicHalfOnly) {
  ASSERT_EQ(Run(file_), 0);
  const std::string made = out_;
  EXPECT_EQ(Run("--show " + file_), 0);
  EXPECT_EQ(out_, made);
  EXPECT_EQ(Run("--show " + file_ + " --json"), 0);
  const auto json = nlohmann::json::parse(out_);
  EXPECT_EQ(json["keys"][0]["name"], "anna");
  EXPECT_EQ(json["keys"][0]["file"], file_);
  EXPECT_EQ(json["keys"][0]["public"], PublicIn(file_));
  EXPECT_THAT(out_, Not(HasSubstr(SeedIn(file_))));
}

TEST_F(KeygenTest, WhatCannotBeShownIsExplainedAndNeverPrinted) {
  EXPECT_EQ(Run("--show " + file_), 1);
  EXPECT_THAT(err_, HasSubstr("does not exist"));
  std::ofstream(file_) << "hunter2";
  chmod(file_.c_str(), 0600);
  EXPECT_EQ(Run("--show " + file_), 1);
  EXPECT_THAT(err_, HasSubstr(file_ + " is no key"));
  EXPECT_THAT(err_ + out_, Not(HasSubstr("hunter2")));
  chmod(file_.c_str(), 0644);
  EXPECT_EQ(Run("--show " + file_), 1);
  EXPECT_THAT(err_, HasSubstr("is open to other users: chmod 640"));
}

TEST_F(KeygenTest, TheKeysOfAMachineWithTheBlockThatItsFileTakes) {
  EXPECT_EQ(Run("--machine press3 --directory " + machine_), 0);
  EXPECT_EQ(Mode(machine_), geteuid() == 0 ? 0755U : 0700U);
  const auto block = out_.find("bridge:\n");
  ASSERT_NE(block, std::string::npos);
  ConfigErrors errors("m.yaml");
  const auto machine =
      ParseConfig("machine: press3\n" + out_.substr(block) +
                      "buses:\n  b0: {family: tformat, devices: {a: {model: ts5669n127}}, simulate: "
                      "true}\n",
                  errors);
  EXPECT_EQ(errors.Text(), "");
  ASSERT_TRUE(machine);
  const BridgeConfig& bridge = machine->bridge;
  EXPECT_FALSE(bridge.allow_unsigned);
  EXPECT_EQ(KeyText(bridge.bridge.public_key.value_or(PublicKey{})), PublicIn(machine_ + "/bridge.key"));
  EXPECT_EQ(KeyText(bridge.drivers.public_key.value_or(PublicKey{})), PublicIn(machine_ + "/drivers.key"));
  ASSERT_EQ(bridge.keys.size(), 1U);
  EXPECT_EQ(bridge.keys[0].name, "local");
  EXPECT_EQ(bridge.keys[0].role, Role::kMaintainer);
  EXPECT_EQ(KeyText(bridge.keys[0].key), PublicIn(machine_ + "/local.key"));
  for (const SecretPlace* place : {&bridge.bridge.place, &bridge.drivers.place, &bridge.keys[0].place}) {
    EXPECT_EQ(Mode(place->file), 0600U);
    EXPECT_THAT(out_, Not(HasSubstr(SeedIn(place->file))));
  }
  const std::string made = out_;
  EXPECT_EQ(Run("--show --machine press3 --directory " + machine_), 0);
  EXPECT_EQ(out_, made);
}

TEST_F(KeygenTest, AMachinesKeysAreMadeTogetherOrNotAtAll) {
  ASSERT_TRUE(std::filesystem::create_directory(machine_));
  std::ofstream(machine_ + "/drivers.key") << "precious";
  EXPECT_EQ(Run("--machine press3 --directory " + machine_), 1);
  EXPECT_THAT(err_, HasSubstr("/drivers.key exists already"));
  EXPECT_EQ(Content(machine_ + "/drivers.key"), "precious");
  EXPECT_FALSE(std::filesystem::exists(machine_ + "/bridge.key"));
  // A name that no file can get ends it half way: what was made goes again.
  std::vector<KeyFile> files = {{"a", folder_.path() + "/a.key", {}}, {"b", folder_.path() + "/no/b.key", {}}};
  EXPECT_THAT(ErrorText(WriteKeys(files, false)), HasSubstr("No such file or directory"));
  EXPECT_FALSE(std::filesystem::exists(folder_.path() + "/a.key"));
}

TEST_F(KeygenTest, MembersOfAGroupMayRead) {
  EXPECT_EQ(Run("--machine press3 --group no-such-group --directory " + machine_), 1);
  EXPECT_THAT(err_, HasSubstr("there is no group 'no-such-group'; as root: groupadd --system no-such-group"));
  EXPECT_FALSE(std::filesystem::exists(machine_));
  if (geteuid() != 0) GTEST_SKIP() << "only root can give files to any group";
  EXPECT_EQ(Run("--machine press3 --group daemon --directory " + machine_), 0);
  struct stat status {};
  ASSERT_EQ(stat((machine_ + "/local.key").c_str(), &status), 0);
  EXPECT_EQ(status.st_mode & 07777U, 0640U);
  EXPECT_EQ(status.st_gid, FindGroup("daemon"));
  for (const char* own : {"/bridge.key", "/drivers.key"}) {
    ASSERT_EQ(stat((machine_ + own).c_str(), &status), 0);
    EXPECT_NE(status.st_gid, FindGroup("daemon")) << own;
  }
  EXPECT_EQ(Run("--show " + machine_ + "/local.key"), 0);
}

TEST_F(KeygenTest, EachProcessMayReadItsOwnKeyOnly) {
  const auto find = [](const std::string& name) -> std::optional<gid_t> {
    if (name == "axlecast-bridge") return 901;
    if (name == "axlecast-drivers") return 902;
    return std::nullopt;
  };
  std::vector<KeyFile> files = MachineKeyFiles(machine_);
  GiveToReaders(files, std::nullopt, find);
  EXPECT_EQ(files.at(0).access.group, 901U);
  EXPECT_EQ(files.at(1).access.group, 902U);
  EXPECT_EQ(files.at(0).access.mode, 0640U);
  EXPECT_EQ(files.at(2).name, "local");
  EXPECT_EQ(files.at(2).access.mode, 0600U) << "a maintainer's";
  GiveToReaders(files, 1'000, find);
  EXPECT_EQ(files.at(0).access.group, 901U) << "operators read no key of a process";
  EXPECT_EQ(files.at(2).access.group, 1'000U);
  std::vector<KeyFile> desk = MachineKeyFiles(machine_);
  GiveToReaders(desk, std::nullopt, [](const std::string&) -> std::optional<gid_t> { return std::nullopt; });
  for (const KeyFile& file : desk) EXPECT_EQ(file.access.mode, 0600U) << file.name;
}

TEST_F(KeygenTest, WrongUsage) {
  EXPECT_EQ(Run(""), 2);
  EXPECT_THAT(err_, HasSubstr("give a FILE, or --machine MACHINE"));
  EXPECT_EQ(Run(file_ + " --machine press3"), 2);
  EXPECT_EQ(Run("--machine Press3"), 2);
  EXPECT_THAT(err_, HasSubstr("'Press3' is no name"));
  EXPECT_EQ(Run(file_ + " --directory /tmp"), 2);
  EXPECT_EQ(Run(file_ + " --show --force"), 2);
  EXPECT_FALSE(std::filesystem::exists(file_));
}

TEST(KeyDirectory, OfRootAndOfAPerson) {
  if (geteuid() == 0) {
    EXPECT_EQ(KeyDirectory("press3"), "/etc/axlecast/press3");
    return;
  }
  setenv("XDG_CONFIG_HOME", "/home/anna/.conf", 1);
  EXPECT_EQ(KeyDirectory("press3"), "/home/anna/.conf/axlecast/press3");
  unsetenv("XDG_CONFIG_HOME");
  setenv("HOME", "/home/anna", 1);
  EXPECT_EQ(KeyDirectory("press3"), "/home/anna/.config/axlecast/press3");
}

TEST(GrantLine, IsYamlWhateverTheFileIsCalled) {
  const PublicKey key = SigningKey::Generate().public_key();
  for (const std::string& file : {std::string("/a b/it's: #1, {x}.key"), std::string("/plain-1_2/k.key")}) {
    ConfigErrors errors("m.yaml");
    const auto machine =
        ParseConfig("machine: a\nbridge:\n  keys:\n" + GrantLine({"anna", file, key}, "observer") +
                        "buses:\n  b0: {family: tformat, devices: {a: {model: ts5669n127}}, simulate: "
                        "true}\n",
                    errors);
    EXPECT_EQ(errors.Text(), "");
    ASSERT_TRUE(machine);
    EXPECT_EQ(machine->bridge.keys.at(0).place.file, file);
  }
}

}  // namespace
}  // namespace axlecast
