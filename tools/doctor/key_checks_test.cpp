#include "tools/doctor/key_checks.h"

#include <gmock/gmock.h>

#include <cerrno>

#include "tools/doctor/doctor_test_host.h"

namespace axlecast {
namespace {

using testing::IsEmpty;

constexpr const char* kOwn = "/etc/axlecast/bridge.key";
constexpr const char* kLocal = "/etc/axlecast/local.key";

MachineConfig Signed() {
  // RFC 8032 7.1, tests 1 and 2.
  const std::string one = "d75a980182b10ab7d54bfed3c964073a0ee172f3daa62325af021a68f707511a";
  const std::string two = "3d4017c3e843895a92b70aa74d1b7ebc9c982ccf2ec4968cc0cd55f12af4660c";
  return OneAxis("", "bridge: {key: {public: " + one + ", file: " + kOwn + "}, keys: {local: {public: " + two +
                         ", role: maintainer, file: " + kLocal + "}}}");
}

HostFile KeyFile(const char* path, mode_t mode, uid_t owner = 0, gid_t group = 0) {
  return {.path = path,
          .kind = HostFile::Kind::kRegular,
          .mode = mode,
          .uid = owner,
          .gid = group,
          .owner = "somebody",
          .group = "axlecast",
          .readable = false};
}

HostFacts WithKeys(const HostFile& own, const HostFile& local) {
  HostFacts host = GoodHost();
  host.secrets.emplace(kOwn, own);
  host.secrets.emplace(kLocal, local);
  return host;
}

struct ModeCase {
  mode_t mode;
  gid_t group;
  const char* line;  // null: nothing is found
};

TEST(KeyChecks, ModesAreThoseThatTheReaderTakes) {
  const ModeCase cases[] = {
      {0600, 0, nullptr},      {0400, 0, nullptr},      {0640, 0, nullptr},      {0440, 7, nullptr},
      {0660, 7, "chmod 640 "}, {0644, 7, "chmod 640 "}, {0644, 0, "chmod 600 "}, {0604, 7, "chmod 600 "},
      {0620, 7, "chmod 600 "}, {0601, 0, "chmod 600 "}, {0777, 7, "chmod 640 "},
  };
  for (const ModeCase& one : cases) {
    const HostFacts host = WithKeys(KeyFile(kOwn, one.mode, 0, one.group), KeyFile(kLocal, 0600));
    const Symptoms findings = CheckKeyMode(Signed(), host);
    ASSERT_EQ(findings.size(), one.line == nullptr ? 0U : 1U) << std::oct << one.mode;
    if (one.line == nullptr) continue;
    EXPECT_EQ(LineOf(findings[0].fixes[0]), one.line + std::string(kOwn));
  }
}

TEST(KeyChecks, TheMachinesOwnKeysAreNoPersons) {
  for (const uid_t owner : {0U, 999U, 1000U}) {  // 1000 runs this
    EXPECT_THAT(CheckKeyOwner(Signed(), WithKeys(KeyFile(kOwn, 0600, owner), KeyFile(kLocal, 0600))), IsEmpty());
  }
  EXPECT_EQ(CheckKeyOwner(Signed(), WithKeys(KeyFile(kOwn, 0600, 1001), KeyFile(kLocal, 0600))).size(), 1U);
  EXPECT_THAT(CheckKeyOwner(Signed(), WithKeys(KeyFile(kOwn, 0600), KeyFile(kLocal, 0600, 1001))), IsEmpty())
      << "a key that commands may be a person's";
}

TEST(KeyChecks, AMissingFileIsToldAndOneThatCannotBeSeenIsNot) {
  HostFile missing = KeyFile(kOwn, 0600);
  missing.error = ENOENT;
  EXPECT_EQ(CheckKeyMissing(Signed(), WithKeys(missing, KeyFile(kLocal, 0600))).size(), 1U);
  missing.error = EACCES;
  EXPECT_THAT(CheckKeyMissing(Signed(), WithKeys(missing, KeyFile(kLocal, 0600))), IsEmpty());
}

TEST(KeyChecks, AUserNeedsOneKeyThatMayCommand) {
  HostFacts host = WithKeys(KeyFile(kOwn, 0600), KeyFile(kLocal, 0640, 0, 7));
  EXPECT_EQ(CheckKeyPermission(Signed(), host).size(), 1U);
  host.secrets.at(kLocal).readable = true;
  EXPECT_THAT(CheckKeyPermission(Signed(), host), IsEmpty());
  host.secrets.at(kLocal) = KeyFile(kLocal, 0600, 1001);
  EXPECT_THAT(CheckKeyPermission(Signed(), host), IsEmpty()) << "another person's key is that person's";
}

TEST(KeyChecks, TheFileIsNotEverybodysToWrite) {
  HostFacts host = GoodHost();
  host.config = KeyFile("m.yaml", 0664);
  EXPECT_THAT(CheckConfigMode(OneAxis(), host), IsEmpty());
  host.config_shared = true;  // with a group that is more than its owner
  EXPECT_EQ(CheckConfigMode(OneAxis(), host).size(), 1U);
  host.config.mode = 0666;
  EXPECT_EQ(LineOf(CheckConfigMode(OneAxis(), host).at(0).fixes.at(0)), "chmod go-w m.yaml");
}

}  // namespace
}  // namespace axlecast
