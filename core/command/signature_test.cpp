#include "core/command/keys.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sodium.h>

#include <axlecast/command_status_t.hpp>

namespace axlecast {
namespace {

constexpr Domain kDomains[] = {Domain::kCommand, Domain::kStatus, Domain::kOrder, Domain::kDriver, Domain::kPermit};

std::vector<std::uint8_t> FromHex(std::string_view text) {
  std::vector<std::uint8_t> bytes(text.size() / 2);
  if (bytes.empty()) return bytes;
  EXPECT_EQ(sodium_hex2bin(bytes.data(), bytes.size(), text.data(), text.size(), nullptr, nullptr, nullptr), 0);
  return bytes;
}
template <typename Array>
Array ArrayOf(std::string_view hex) {
  Array array{};
  const std::vector<std::uint8_t> bytes = FromHex(hex);
  EXPECT_EQ(bytes.size(), array.size());
  std::copy_n(bytes.begin(), std::min(bytes.size(), array.size()), array.begin());
  return array;
}
std::vector<std::uint8_t> BytesOf(std::string_view text) { return {text.begin(), text.end()}; }

SigningKey KeyOf(std::string_view seed) {
  auto key = SigningKey::Parse("axlecast-key-1 " + std::string(seed) + "\n");
  EXPECT_TRUE(key);
  return key ? std::move(*key) : SigningKey::Generate();
}

// RFC 8032, section 7.1, TEST 1 to 3.
struct Rfc8032 {
  const char* secret;
  const char* key;
  const char* message;
  const char* signature;
};
constexpr Rfc8032 kRfc8032[] = {
    {"9d61b19deffd5a60ba844af492ec2cc44449c5697b326919703bac031cae7f60",
     "d75a980182b10ab7d54bfed3c964073a0ee172f3daa62325af021a68f707511a", "",
     "e5564300c360ac729086e2cc806e828a84877f1eb8e5d974d873e065224901555fb8821590a33bacc61e39701cf9b46bd25bf5f0595bb"
     "e"
     "24655141438e7a100b"},
    {"4ccd089b28ff96da9db6c346ec114e0f5b8a319f35aba624da8cf6ed4fb8a6fb",
     "3d4017c3e843895a92b70aa74d1b7ebc9c982ccf2ec4968cc0cd55f12af4660c", "72",
     "92a009a9f0d4cab8720e820b5f642540a2b27b5416503f8fb3762223ebdb69da085ac1e43e15996e458f3613d0f11d8c387b2eaeb4302"
     "a"
     "eeb00d291612bb0c00"},
    {"c5aa8df43f9f837bedb7442f31dcb7b166d38535076f094b85ce3a2e0b4458f7",
     "fc51cd8e6218a1a38da47ed00230f0580816ed13ba3303ac5deb911548908025", "af82",
     "6291d657deec24024827e69c3abe01a30ce548a284743a445e3680d7db5ac3ac18ff9b538d16f290ae67f760984dc6594a7c15e9716ed"
     "2"
     "8dc027beceea1ec40a"},
};

TEST(Ed25519, ThePrimitiveIsThatOfTheRfc) {
  for (const Rfc8032& test : kRfc8032) {
    const auto message = FromHex(test.message);
    const auto key = ArrayOf<PublicKey>(test.key);
    EXPECT_EQ(KeyOf(test.secret).public_key(), key);
    EXPECT_EQ(crypto_sign_verify_detached(ArrayOf<Signature>(test.signature).data(), message.data(), message.size(),
                                          key.data()),
              0);
  }
}

// Of the RFC's first key by OpenSSL 3.0.19: printf 'axlecast-command-1of axis1' > m;
// openssl pkeyutl -sign -rawin -inkey key.der -keyform DER -in m. Ed25519 signatures have no random part.
TEST(Ed25519, SignaturesAreThoseOfOpenSslOverPrefixAndMessage) {
  constexpr const char* kExpected[] = {
      "32810b40893972a424327fdda142fc18910f365f9a391919d7d417375ec6ab2c8e52073007e90c8bbaecb1ff1a4f739a36d716be53c2"
      "15252ff8cbd666d5f30c",
      "40c4b05d762abd7f51ca4f36d32be94ba83c06cc4e060e750aad18069514182eaf914e4bed0ba2f176a073913d5d4e697edfecc19dd6"
      "175ab44f6d20b0d5540b",
      "5a376f2a609ee89b1f883c23461c7e755f4dd98a578bb599146f697f7df246ab6e6082fca839478e3df3670096b979eff73129de5aa5"
      "daf3f52e992e6349b20c",
      "e5b599a2a111187fcfece26c7279be8009e1eda3f2285df94a6d69e8e621780049404a0746d659e0aa3722af7e7436cf9494e3697509"
      "3ab10d04f488e19cbf03",
      "cafdf5915a3b6a2b40e7141f6de473acc157c636865044241b16e368f5850fcfc32d03fbd52a72907b91baf4c7fe1717effb43073a58"
      "efe48f2f9479c40aa005"};
  const SigningKey key = KeyOf(kRfc8032[0].secret);
  const auto message = BytesOf("of axis1");
  for (std::size_t i = 0; i < std::size(kDomains); ++i) {
    EXPECT_EQ(key.Sign(kDomains[i], message), ArrayOf<Signature>(kExpected[i]));
    EXPECT_TRUE(Verify(key.public_key(), kDomains[i], message, ArrayOf<Signature>(kExpected[i])));
  }
}

TEST(Ed25519, NoSignatureIsGoodForAnotherPurposeMessageOrKey) {
  const SigningKey key = SigningKey::Generate();
  const auto message = BytesOf("of axis1");
  for (const Domain signed_for : kDomains) {
    const Signature signature = key.Sign(signed_for, message);
    for (const Domain used_for : kDomains) {
      EXPECT_EQ(Verify(key.public_key(), used_for, message, signature), signed_for == used_for);
    }
    EXPECT_FALSE(Verify(key.public_key(), signed_for, BytesOf("of axis2"), signature));
    EXPECT_FALSE(Verify(key.public_key(), signed_for, BytesOf("of axis"), signature));
    EXPECT_FALSE(Verify(key.public_key(), signed_for, {}, signature));
    EXPECT_FALSE(Verify(SigningKey::Generate().public_key(), signed_for, message, signature));
  }
}

TEST(Ed25519, NoSingleBitCanBeChanged) {
  const SigningKey key = SigningKey::Generate();
  std::vector<std::uint8_t> message = BytesOf("zero_single_turn of axis1");
  const Signature signature = key.Sign(Domain::kOrder, message);
  const auto flip = [](auto& bytes, std::size_t bit) {
    bytes[bit / 8] ^= static_cast<std::uint8_t>(1U << bit % 8);
  };
  for (std::size_t bit = 0; bit < 8 * message.size(); ++bit) {
    flip(message, bit);
    EXPECT_FALSE(Verify(key.public_key(), Domain::kOrder, message, signature)) << "message, bit " << bit;
    flip(message, bit);
  }
  for (std::size_t bit = 0; bit < 8 * signature.size(); ++bit) {
    Signature bad = signature;
    flip(bad, bit);
    EXPECT_FALSE(Verify(key.public_key(), Domain::kOrder, message, bad)) << "signature, bit " << bit;
  }
  for (std::size_t bit = 0; bit < 8 * sizeof(PublicKey); ++bit) {
    PublicKey bad = key.public_key();
    flip(bad, bit);
    EXPECT_FALSE(Verify(bad, Domain::kOrder, message, signature)) << "key, bit " << bit;
  }
  EXPECT_TRUE(Verify(key.public_key(), Domain::kOrder, message, signature));
}

// With a public key of small order anybody could sign: S = 0 and R the neutral point fit every eighth message. The
// encodings are those that libsodium's ge25519_has_small_order lists; it refuses them, as it does encodings that are
// not the shortest.
TEST(Ed25519, KeysOfSmallOrderVerifyNothing) {
  constexpr const char* kSmall[] = {"0000000000000000000000000000000000000000000000000000000000000000",
                                    "0100000000000000000000000000000000000000000000000000000000000000",
                                    "26e8958fc2b227b045c3f489f2ef98f0d5dfac05d3c63339b13802886d53fc05",
                                    "c7176a703d4dd84fba3c0b760d10670f2a2053fa2c39ccc64ec7fd7792ac037a",
                                    "ecffffffffffffffffffffffffffffffffffffffffffffffffffffffffffff7f",
                                    "edffffffffffffffffffffffffffffffffffffffffffffffffffffffffffff7f",
                                    "eeffffffffffffffffffffffffffffffffffffffffffffffffffffffffffff7f"};
  Signature neutral{};
  neutral[0] = 1;
  for (const char* text : kSmall) {
    for (const std::uint8_t sign : {std::uint8_t{0}, std::uint8_t{0x80}}) {
      auto key = ArrayOf<PublicKey>(text);
      key[31] = static_cast<std::uint8_t>(key[31] | sign);
      EXPECT_FALSE(ParsePublicKey(KeyText(key))) << KeyText(key);
      for (int i = 0; i < 64; ++i) {
        const auto message = BytesOf(std::to_string(i));
        EXPECT_FALSE(Verify(key, Domain::kCommand, message, neutral)) << KeyText(key);
        EXPECT_FALSE(Verify(key, Domain::kCommand, message, Signature{})) << KeyText(key);
      }
    }
  }
}

// RFC 8032, 5.1.7: S below L, else each signature would have a second form. L is 2^252 +
// 27742317777372353535851937790883648493; here little-endian.
TEST(Ed25519, ASignatureHasOneFormOnly) {
  const auto order = ArrayOf<PublicKey>("edd3f55c1a631258d69cf7a2def9de1400000000000000000000000000000010");
  const SigningKey key = SigningKey::Generate();
  const auto message = BytesOf("of axis1");
  for (int i = 0; i < 16; ++i) {
    Signature signature = key.Sign(Domain::kPermit, message);
    unsigned carry = 0;
    for (std::size_t j = 0; j < order.size(); ++j) {
      carry += 0U + signature[32 + j] + order[j];
      signature[32 + j] = static_cast<std::uint8_t>(carry);
      carry >>= 8;
    }
    ASSERT_EQ(carry, 0U);
    EXPECT_FALSE(Verify(key.public_key(), Domain::kPermit, message, signature));
  }
}

TEST(SigningKey, GoesIntoAFileAndBack) {
  const SigningKey key = SigningKey::Generate();
  const std::string text = key.FileText();
  EXPECT_THAT(text, ::testing::MatchesRegex("axlecast-key-1 [0-9a-f]+\n"));
  EXPECT_EQ(text.size(), 15U + 64U + 1U);
  EXPECT_EQ(KeyOf(std::string_view(text).substr(15, 64)).public_key(), key.public_key());
  EXPECT_TRUE(SigningKey::Parse(text.substr(0, 79) + "\r\n"));
  EXPECT_NE(SigningKey::Generate().public_key(), key.public_key());
}

TEST(SigningKey, NothingElseIsAKey) {
  const std::string good = SigningKey::Generate().FileText();
  for (const std::string& text :
       {std::string(), std::string("axlecast-key-1"), std::string("axlecast-key-1 "), good.substr(0, 78),
        "x" + good, good.substr(0, 79) + "0", good.substr(15), "axlecast-key-2 " + good.substr(15), good + good,
        "axlecast-key-1  " + good.substr(15), std::string(15, ' ') + good.substr(15), good.substr(0, 78) + "g\n",
        good.substr(0, 78) + std::string(1, '\0')}) {
    EXPECT_FALSE(SigningKey::Parse(text)) << text;
  }
}

TEST(SigningKey, IsGoneWhereItWasMovedFrom) {
  SigningKey key = SigningKey::Generate();
  const std::string text = key.FileText();
  const SigningKey moved = std::move(key);
  EXPECT_EQ(moved.FileText(), text);
  // NOLINTNEXTLINE(bugprone-use-after-move): that is what is looked at
  EXPECT_EQ(key.FileText(), "axlecast-key-1 " + std::string(64, '0') + "\n");
}

TEST(PublicKeyText, IsHexOfAPointOfTheCurve) {
  const PublicKey key = SigningKey::Generate().public_key();
  const std::string text = KeyText(key);
  EXPECT_EQ(ParsePublicKey(text), key);
  for (const std::string& bad : {std::string(), text.substr(1), text + "0", std::string("g") + text.substr(1),
                                 " " + text.substr(1), std::string(63, '0') + "2", std::string(64, 'f')}) {
    EXPECT_FALSE(ParsePublicKey(bad)) << bad;
  }
}

// Value of Python's hashlib.blake2b(key, digest_size=32) of the RFC's first key.
TEST(KeyId, IsTheBeginningOfItsBlake2b256) {
  EXPECT_EQ(static_cast<std::uint64_t>(KeyId(ArrayOf<PublicKey>(kRfc8032[0].key))), 0x7849ac3049680be1U);
}

TEST(SignedMessage, HoldsItsOwnSignature) {
  const SigningKey key = SigningKey::Generate();
  command_status_t status{};
  status.text = "done";
  SignMessage(key, Domain::kStatus, status);
  EXPECT_TRUE(VerifyMessage(key.public_key(), Domain::kStatus, status));
  EXPECT_FALSE(VerifyMessage(key.public_key(), Domain::kDriver, status));
  SignMessage(key, Domain::kStatus, status);
  EXPECT_TRUE(VerifyMessage(key.public_key(), Domain::kStatus, status)) << "the old signature does not count";
  status.seq += 1;
  EXPECT_FALSE(VerifyMessage(key.public_key(), Domain::kStatus, status));
}

}  // namespace

}  // namespace axlecast
