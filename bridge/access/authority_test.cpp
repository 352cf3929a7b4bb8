#include "bridge/access/admission.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <axlecast/command_status_t.hpp>
#include <random>

#include "bridge/access/authority_fixture.h"
#include "core/base/text.h"
#include "core/messages/message.h"

namespace axlecast {
namespace {

using ::testing::HasSubstr;
using S = command_status_t;

constexpr OperationSpec kLook = {.name = "look", .help = "", .reads_only = true};
constexpr OperationSpec kMark = {.name = "mark", .help = ""};
constexpr OperationSpec kZero = {.name = "zero", .help = "", .destructive = true, .needs_permit = true};

class AuthorityTest : public ::testing::Test {
 protected:
  // Returns the name of the sender, or "reason: text".
  static std::string Text(const Result<Caller>& answer) {
    if (answer) return answer->who;
    const Error& error = answer.error();
    EXPECT_LE(error.text.size(), kTextBytes) << error.text;
    return std::to_string(error.reason) + ": " + error.text;
  }
  // Identifies the sender from the bytes of the envelope, as the bridge does.
  [[nodiscard]] std::string SenderOf(const command_t& envelope) const {
    const auto body = DecodeMessage<command_body_t>(envelope.body);
    return body ? Text(authority_.Identify(envelope, *body)) : "no body";
  }
  [[nodiscard]] std::string May(const std::string& key, const OperationSpec& operation,
                                const std::string& device = "axis1") const {
    const Result<> allowed = authority_.Check(As(key), device, operation);
    if (allowed) return "yes";
    EXPECT_LE(allowed.error().text.size(), kTextBytes);
    EXPECT_EQ(allowed.error().reason, S::REASON_DENIED);
    return allowed.error().text;
  }
  [[nodiscard]] Caller As(const std::string& name) const {
    for (const KeyGrant& grant : keys_.config.keys) {
      if (grant.name == name) return {.who = name, .key_id = grant.id, .grant = &grant};
    }
    return {.who = "unsigned"};
  }

  AccessKeys keys_;
  const Authority authority_{keys_.config};
};

TEST_F(AuthorityTest, AGoodSignatureOfAListedKeyNamesItsOwner) {
  for (const char* name : {"viewer", "shift", "plc", "service"}) {
    const command_t envelope = keys_.Signed(name);
    const auto answer = authority_.Identify(envelope, AccessKeys::BodyOf(envelope));
    ASSERT_TRUE(answer.has_value()) << Text(answer);
    const auto& caller = *answer;
    EXPECT_EQ(caller.who, name);
    EXPECT_EQ(caller.grant->name, name);
    EXPECT_EQ(caller.key_id, KeyId(keys_.Secret(name).public_key()));
  }
}

TEST_F(AuthorityTest, UnsignedOnlyWhereTheFileAllowsIt) {
  command_t envelope = keys_.Signed("service");
  AccessKeys::SetBody(envelope, {});
  std::fill(std::begin(envelope.sig), std::end(envelope.sig), std::uint8_t{0});
  EXPECT_THAT(SenderOf(envelope), HasSubstr("8: it is not signed: send it with a key of the machine's file"));
  keys_.config.allow_unsigned = true;
  EXPECT_EQ(SenderOf(envelope), "unsigned");
  keys_.config.allow_unsigned = false;
  keys_.config.keys.clear();
  EXPECT_THAT(SenderOf(envelope), HasSubstr("8: it is not signed, and the machine's file names no key that could"));
}

TEST_F(AuthorityTest, ASignatureIsVerifiedAlsoWhereNoneIsNeeded) {
  keys_.config.allow_unsigned = true;
  command_t envelope = keys_.Signed("service");
  EXPECT_EQ(SenderOf(envelope), "service");
  envelope.sig[5] ^= 1;
  EXPECT_EQ(SenderOf(envelope).substr(0, 2), "7:");
  std::fill(std::begin(envelope.sig), std::end(envelope.sig), std::uint8_t{0});
  EXPECT_EQ(SenderOf(envelope).substr(0, 2), "7:") << "a key id means that it was signed";
  envelope = keys_.Signed("service");
  AccessKeys::SetBody(envelope, {});
  EXPECT_THAT(SenderOf(envelope), HasSubstr("7: it is signed, but names no key (key_id 0)"));
}

TEST_F(AuthorityTest, AnUnknownKeyIsNamedByItsId) {
  const SigningKey stranger = SigningKey::Generate();
  command_body_t body{};
  body.key_id = 0x0123456789ABCDEF;
  EXPECT_THAT(SenderOf(AccessKeys::Signed(stranger, body)),
              HasSubstr("7: key 0123456789abcdef is not in the bridge's machine file"));
}

TEST_F(AuthorityTest, TheKeyIdMustBeThatOfTheKeyWhichSigned) {
  command_body_t body = AccessKeys::BodyOf(keys_.Signed("viewer"));
  body.key_id = KeyId(keys_.Secret("service").public_key());
  EXPECT_THAT(SenderOf(AccessKeys::Signed(keys_.Secret("viewer"), body)),
              HasSubstr("7: its signature is not of key service"));
}

TEST_F(AuthorityTest, TheKeysOfTheBridgeAndItsDriversCommandNothing) {
  for (const SigningKey* key : {&keys_.bridge, &keys_.drivers}) {
    command_body_t body{};
    body.key_id = KeyId(key->public_key());
    EXPECT_THAT(SenderOf(AccessKeys::Signed(*key, body)), HasSubstr("is not in the bridge's machine file"));
  }
}

TEST_F(AuthorityTest, ASignatureForAnotherPurposeIsNone) {
  const command_t envelope = keys_.Signed("service");
  for (const Domain domain : {Domain::kStatus, Domain::kOrder, Domain::kDriver, Domain::kPermit}) {
    command_t moved = envelope;
    const Signature signature = keys_.Secret("service").Sign(domain, envelope.body);
    std::copy(signature.begin(), signature.end(), std::begin(moved.sig));
    EXPECT_EQ(SenderOf(moved).substr(0, 2), "7:");
  }
}

TEST_F(AuthorityTest, NoSingleBitCanBeChanged) {
  const command_t good = keys_.Signed("service");
  ASSERT_EQ(SenderOf(good), "service");
  for (std::size_t bit = 0; bit < 8 * good.body.size(); ++bit) {
    command_t bad = good;
    bad.body[bit / 8] ^= static_cast<std::uint8_t>(1U << bit % 8);
    EXPECT_NE(SenderOf(bad), "service") << "bit " << bit << " of the body";
  }
  for (std::size_t bit = 0; bit < 8 * sizeof good.sig; ++bit) {
    command_t bad = good;
    bad.sig[bit / 8] ^= static_cast<std::uint8_t>(1U << bit % 8);
    EXPECT_EQ(SenderOf(bad).substr(0, 2), "7:") << "bit " << bit << " of the signature";
  }
}

// 10^5 here; tools/campaign sends 10^6 to a bridge.
TEST_F(AuthorityTest, AFloodOfForgeriesPassesNotOnce) {
  constexpr std::uint32_t kSeed = 20'260'501;
  std::mt19937 random(kSeed);
  const auto below = [&](std::size_t maximum) { return random() % maximum; };
  const std::vector<command_t> good = {keys_.Signed("viewer"), keys_.Signed("plc"), keys_.Signed("service")};
  keys_.config.allow_unsigned = true;
  int verified = 0;
  for (int i = 0; i < 100'000; ++i) {
    command_t forged = good[below(good.size())];
    const command_t& other = good[below(good.size())];
    switch (below(5)) {
      case 0:  // some bits of the body
        for (std::size_t n = 1 + below(8); n > 0; --n) {
          forged.body[below(forged.body.size())] ^= static_cast<std::uint8_t>(1U << below(8));
        }
        break;
      case 1:  // some bits of the signature
        for (std::size_t n = 1 + below(8); n > 0; --n)
          forged.sig[below(64)] ^= static_cast<std::uint8_t>(1U << below(8));
        break;
      case 2:  // the signature of another command
        std::copy(std::begin(other.sig), std::end(other.sig), std::begin(forged.sig));
        break;
      case 3:  // another body under it
        forged.body = other.body;
        break;
      default:  // half of each
        std::copy(other.sig + 32, other.sig + 64, forged.sig + 32);
    }
    const bool same = std::any_of(good.begin(), good.end(), [&](const command_t& one) {
      return one.body == forged.body && std::equal(std::begin(one.sig), std::end(one.sig), std::begin(forged.sig));
    });
    if (same) continue;
    const auto body = DecodeMessage<command_body_t>(forged.body);
    if (!body) continue;
    if (keys_.config.FindKey(body->key_id) != nullptr) ++verified;
    ASSERT_FALSE(authority_.Identify(forged, *body)) << "forgery " << i;
  }
  EXPECT_GT(verified, 50'000) << "most must reach the signature";
}

TEST_F(AuthorityTest, ARoleAllowsWhatItSays) {
  EXPECT_EQ(May("viewer", kLook), "yes");
  EXPECT_EQ(May("viewer", kMark), "key viewer has role observer: mark needs operator, control or maintainer");
  EXPECT_EQ(May("viewer", kZero), "key viewer has role observer: zero needs maintainer");
  EXPECT_EQ(May("shift", kLook), "yes");
  EXPECT_EQ(May("shift", kMark), "yes");
  EXPECT_EQ(May("shift", kZero), "key shift has role operator: zero needs maintainer");
  EXPECT_EQ(May("plc", kZero), "key plc has role control: zero needs maintainer") << "it permits it, no more";
  for (const OperationSpec& operation : {kLook, kMark, kZero}) {
    EXPECT_EQ(May("service", operation), "yes");
    EXPECT_EQ(May("nobody", operation), "yes") << "unsigned, which Identify has let pass";
  }
}

TEST_F(AuthorityTest, AKeyMayBeForSomeDevicesAndOperationsOnly) {
  EXPECT_EQ(May("plc", kMark), "yes");
  EXPECT_EQ(May("plc", kMark, "axis2"), "key plc is not for device axis2 (bridge.keys.plc.devices)");
  EXPECT_EQ(May("plc", kLook), "key plc is not for operation look (bridge.keys.plc.operations)");
}

TEST_F(AuthorityTest, TextsFitWhateverIsAsked) {
  const OperationSpec operation = {.name = "123456789_123456789_123456789_", .help = "", .destructive = true};
  const Caller caller = As("plc");
  for (const bool destructive : {true, false}) {
    OperationSpec asked = operation;
    asked.destructive = destructive;
    for (const std::string& device : {std::string("axis1"), std::string(1'000, '\n')}) {
      const Result<> allowed = authority_.Check(caller, device, asked);
      ASSERT_FALSE(allowed);
      EXPECT_LE(allowed.error().text.size(), kTextBytes);
      EXPECT_EQ(allowed.error().text.find('\n'), std::string::npos);
    }
  }
}

TEST_F(AuthorityTest, WhoMayCancel) {
  EXPECT_TRUE(authority_.MayCancel(As("shift"), "shift"));
  EXPECT_FALSE(authority_.MayCancel(As("shift"), "service"));
  EXPECT_FALSE(authority_.MayCancel(As("plc"), "shift"));
  EXPECT_TRUE(authority_.MayCancel(As("service"), "shift"));
  EXPECT_TRUE(authority_.MayCancel(As("service"), "unsigned"));
  EXPECT_TRUE(authority_.MayCancel(As("nobody"), "unsigned"));
  EXPECT_FALSE(authority_.MayCancel(As("nobody"), "shift"));
}

}  // namespace
}  // namespace axlecast
