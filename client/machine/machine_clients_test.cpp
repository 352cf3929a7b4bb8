#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/stat.h>

#include <fstream>

#include "client/axlecast/machine_settings.h"
#include "core/command/keys.h"
#include "tests/support/temporary_folder.h"

namespace axlecast {
namespace {

using testing::HasSubstr;

class SettingsOfMachineTest : public testing::Test {
 protected:
  void Write(const std::string& name, const std::string& text) const {
    std::ofstream(Path(name)) << text;
    ASSERT_EQ(chmod(Path(name).c_str(), 0600), 0);
  }
  [[nodiscard]] std::string Path(const std::string& name) const { return folder_.path() + "/" + name; }
  void WriteMachine() {
    Write("plc.key", plc_.FileText());
    Write("machine.yaml",
          "machine: m\nlcm: {command_url: 'udpm://239.255.76.67:7777?ttl=0', prefix: p_}\n"
          "bridge:\n  key: {public: " +
              KeyText(bridge_.public_key()) +
              ", file: /nowhere/b}\n"
              "  keys:\n    far: {public: " +
              KeyText(far_.public_key()) +
              ", role: maintainer}\n"
              "    plc: {public: " +
              KeyText(plc_.public_key()) + ", role: control, file: " + Path("plc.key") +
              "}\n"
              "buses:\n  b:\n    family: tformat\n    link: {port: /dev/null, baud: 2500000}\n"
              "    devices:\n      axis1: {model: ts5669n127}\n");
  }

  const TemporaryFolder folder_;
  const SigningKey bridge_ = SigningKey::Generate();
  const SigningKey plc_ = SigningKey::Generate();
  const SigningKey far_ = SigningKey::Generate();
};

TEST_F(SettingsOfMachineTest, ReadsUrlPrefixAndKeys) {
  WriteMachine();
  const auto settings = SettingsOfMachine(Path("machine.yaml"), "");
  ASSERT_TRUE(settings) << settings.error().text;
  EXPECT_EQ(settings->command_url, "udpm://239.255.76.67:7777?ttl=0");
  EXPECT_EQ(settings->prefix, "p_");
  EXPECT_EQ(settings->bridge_key, KeyText(bridge_.public_key()));
  EXPECT_EQ(settings->key_file, Path("plc.key"));
}

TEST_F(SettingsOfMachineTest, SaysWhatIsWrong) {
  WriteMachine();
  EXPECT_THAT(ErrorText(SettingsOfMachine(Path("machine.yaml"), "far")), HasSubstr("far"));
  EXPECT_THAT(ErrorText(SettingsOfMachine(Path("machine.yaml"), "nobody")), HasSubstr("there are far, plc"));
  EXPECT_THAT(ErrorText(SettingsOfMachine(Path("none.yaml"), "")), HasSubstr("none.yaml"));
}

}  // namespace
}  // namespace axlecast
