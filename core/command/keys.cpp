#include "core/command/keys.h"

#include <sodium.h>

#include <stdexcept>

#include "core/base/text.h"
#include "core/command/commands.h"

namespace axlecast {
namespace {

constexpr std::string_view kFileHead = "axlecast-key-1 ";
constexpr std::size_t kSeedBytes = crypto_sign_SEEDBYTES;

static_assert(crypto_sign_PUBLICKEYBYTES == sizeof(PublicKey));
static_assert(crypto_sign_BYTES == sizeof(Signature));

constexpr std::array<std::string_view, 5> kPrefixes = {"axlecast-command-1", "axlecast-status-1",
                                                       "axlecast-order-1", "axlecast-driver-1",
                                                       "axlecast-permit-1"};  // by Domain

std::vector<std::uint8_t> Prefixed(Domain domain, Bytes message) {
  const std::string_view prefix = kPrefixes.at(static_cast<std::size_t>(domain));
  std::vector<std::uint8_t> bytes(prefix.begin(), prefix.end());
  bytes.insert(bytes.end(), message.begin(), message.end());
  return bytes;
}

std::string NameOf(const SecretPlace& place) {
  return place.file.empty() ? "credential '" + place.credential + '\'' : place.file;
}

Result<SigningKey> Load(const SecretPlace& place, SecretSource& secrets) {
  const Result<Secret> text = secrets.Read(place);
  if (!text) return Failure(text.error());
  std::optional<SigningKey> key = SigningKey::Parse(text->text());
  if (!key) return Failure(NameOf(place) + " is no key: axlecast keygen FILE writes one (docs/keys.md)");
  return std::move(*key);
}

Result<std::optional<SigningKey>> LoadHalf(const SecretPlace& place, const std::optional<PublicKey>& configured,
                                           SecretSource& secrets) {
  if (place.empty()) return std::nullopt;
  Result<SigningKey> key = Load(place, secrets);
  if (!key) return Failure(key.error());
  if (!configured || key->public_key() == *configured) return std::move(*key);
  return Failure(NameOf(place) + " holds another key than the machine's file names: its public key is " +
                 KeyText(key->public_key()) + ", the machine's file has " + KeyText(*configured) +
                 "; put the first into the machine's file, or the right key into the place");
}

}  // namespace

SigningKey SigningKey::Generate() {
  if (sodium_init() < 0) throw std::runtime_error("libsodium: no source of random numbers");
  SigningKey key;
  crypto_sign_keypair(key.public_key_.data(), key.secret_.data());
  return key;
}

std::optional<SigningKey> SigningKey::Parse(std::string_view file_text) {
  while (!file_text.empty() && (file_text.back() == '\n' || file_text.back() == '\r')) file_text.remove_suffix(1);
  if (!file_text.starts_with(kFileHead)) return std::nullopt;
  std::array<std::uint8_t, kSeedBytes> seed{};
  std::optional<SigningKey> key;
  if (ParseHex(file_text.substr(kFileHead.size()), seed)) {
    key = SigningKey();
    crypto_sign_seed_keypair(key->public_key_.data(), key->secret_.data(), seed.data());
  }
  sodium_memzero(seed.data(), seed.size());
  return key;
}

SigningKey::SigningKey(SigningKey&& other) noexcept : secret_(other.secret_), public_key_(other.public_key_) {
  sodium_memzero(other.secret_.data(), other.secret_.size());
}

SigningKey& SigningKey::operator=(SigningKey&& other) noexcept {
  if (this == &other) return *this;
  secret_ = other.secret_;
  public_key_ = other.public_key_;
  sodium_memzero(other.secret_.data(), other.secret_.size());
  return *this;
}

SigningKey::~SigningKey() { sodium_memzero(secret_.data(), secret_.size()); }

Signature SigningKey::Sign(Domain domain, Bytes message) const {
  const std::vector<std::uint8_t> bytes = Prefixed(domain, message);
  Signature signature{};
  crypto_sign_detached(signature.data(), nullptr, bytes.data(), bytes.size(), secret_.data());
  return signature;
}

std::string SigningKey::FileText() const {
  // libsodium keeps the seed in the first half of the secret key. Its own conversion does not depend on the bytes.
  std::string seed(2 * kSeedBytes + 1, '\0');
  sodium_bin2hex(seed.data(), seed.size(), secret_.data(), kSeedBytes);
  seed.back() = '\n';
  return std::string(kFileHead) + seed;
}

bool Verify(const PublicKey& key, Domain domain, Bytes message, const Signature& signature) {
  const std::vector<std::uint8_t> bytes = Prefixed(domain, message);
  return crypto_sign_verify_detached(signature.data(), bytes.data(), bytes.size(), key.data()) == 0;
}

std::int64_t KeyId(const PublicKey& key) {
  const std::int64_t id = BodyDigest(key);
  return id != 0 ? id : 1;
}

std::string KeyText(const PublicKey& key) { return HexDigits(key); }

std::optional<PublicKey> ParsePublicKey(std::string_view text) {
  PublicKey key{};
  if (!ParseHex(text, key) || crypto_core_ed25519_is_valid_point(key.data()) == 0) {
    return std::nullopt;
  }
  return key;
}

std::string_view RoleName(Role role) { return kRoleNames.at(static_cast<std::size_t>(role)); }

bool IsAllowed(Role role, const OperationSpec& operation) {
  switch (role) {
    case Role::kObserver:
      return operation.reads_only && !operation.destructive;
    case Role::kOperator:
    case Role::kControl:
      return !operation.destructive;
    case Role::kMaintainer:
      return true;
  }
  return false;
}

std::string_view AllowedRoles(const OperationSpec& operation) {
  if (operation.destructive) return "maintainer";
  return operation.reads_only ? "observer, operator, control or maintainer" : "operator, control or maintainer";
}

Result<std::optional<SigningKey>> LoadKey(const OwnKey& own, SecretSource& secrets) {
  return LoadHalf(own.place, own.public_key, secrets);
}

Result<std::optional<SigningKey>> LoadKey(const KeyGrant& grant, SecretSource& secrets) {
  return LoadHalf(grant.place, grant.key, secrets);
}

Result<SigningKey> LoadKeyFile(const std::string& path, SecretSource& secrets) {
  if (path.empty()) return Failure("no key file is named");
  return Load({.file = path, .credential = {}, .group_may_read = true}, secrets);
}

}  // namespace axlecast
