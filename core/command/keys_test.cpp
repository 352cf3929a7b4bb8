#include "core/command/keys.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "core/base/result.h"
#include "tests/support/fixed_secrets.h"

namespace axlecast {
namespace {

using ::testing::AllOf;
using ::testing::HasSubstr;
using ::testing::Not;

constexpr const char* kFile = "/etc/axlecast/bridge.key";

class OwnKeyTest : public ::testing::Test {
 protected:
  std::optional<PublicKey> Load(const OwnKey& own) { return KeyOf(LoadKey(own, secrets_)); }
  // Notes the error of a load, and returns the public half of its key.
  std::optional<PublicKey> KeyOf(const Result<std::optional<SigningKey>>& key) {
    problem_ = ErrorText(key);
    return key && *key ? std::optional((*key)->public_key()) : std::nullopt;
  }
  std::optional<PublicKey> KeyOf(const Result<SigningKey>& key) {
    problem_ = ErrorText(key);
    return key ? std::optional(key->public_key()) : std::nullopt;
  }
  [[nodiscard]] OwnKey Own() const {
    return {.public_key = key_.public_key(), .place = {.file = kFile, .credential = {}, .group_may_read = true}};
  }

  const SigningKey key_ = SigningKey::Generate();
  FixedSecrets secrets_;
  std::string problem_ = "from before";
};

TEST_F(OwnKeyTest, WithoutAPlaceThereIsNothingToSay) {
  EXPECT_FALSE(Load({.public_key = key_.public_key(), .place = {}}));
  EXPECT_EQ(problem_, "");
  EXPECT_FALSE(Load({}));
  EXPECT_EQ(problem_, "");
}

TEST_F(OwnKeyTest, FromItsFileOrCredential) {
  secrets_.files[kFile] = key_.FileText();
  EXPECT_EQ(Load(Own()), key_.public_key());
  EXPECT_EQ(problem_, "");
  secrets_.files["bridge"] = key_.FileText();
  EXPECT_EQ(Load({.public_key = key_.public_key(), .place = {.file = {}, .credential = "bridge"}}),
            key_.public_key());
}

TEST_F(OwnKeyTest, WhatIsWrongIsNamedButNeverShown) {
  EXPECT_FALSE(Load(Own()));
  EXPECT_EQ(problem_, "/etc/axlecast/bridge.key does not exist");

  secrets_.files[kFile] = "hunter2\n";
  EXPECT_FALSE(Load(Own()));
  EXPECT_THAT(problem_, AllOf(HasSubstr("/etc/axlecast/bridge.key is no key: axlecast keygen FILE writes one"),
                              Not(HasSubstr("hunter2"))));

  const SigningKey other = SigningKey::Generate();
  secrets_.files[kFile] = other.FileText();
  EXPECT_FALSE(Load(Own()));
  EXPECT_EQ(problem_,
            "/etc/axlecast/bridge.key holds another key than the machine's file names: its public key is " +
                KeyText(other.public_key()) + ", the machine's file has " + KeyText(key_.public_key()) +
                "; put the first into the machine's file, or the right key into the place");
  EXPECT_THAT(problem_, Not(HasSubstr(other.FileText().substr(15, 64))));
}

TEST_F(OwnKeyTest, TheKeyOfAPersonAndOfABareFile) {
  KeyGrant grant;
  EXPECT_FALSE(KeyOf(LoadKey(grant, secrets_)));
  EXPECT_EQ(problem_, "");
  grant.key = key_.public_key();
  grant.place.file = kFile;
  secrets_.files[kFile] = key_.FileText();
  EXPECT_TRUE(KeyOf(LoadKey(grant, secrets_)));
  EXPECT_TRUE(KeyOf(LoadKeyFile(kFile, secrets_)));
  grant.key = SigningKey::Generate().public_key();
  EXPECT_FALSE(KeyOf(LoadKey(grant, secrets_)));
  EXPECT_THAT(problem_, HasSubstr("holds another key"));
  EXPECT_FALSE(KeyOf(LoadKeyFile("", secrets_)));
  EXPECT_EQ(problem_, "no key file is named");
}

}  // namespace

}  // namespace axlecast
