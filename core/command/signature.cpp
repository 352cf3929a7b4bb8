#include "core/command/signature.h"

#include <sodium.h>

#include <stdexcept>

#include "core/base/text.h"
#include "core/command/command_id.h"

namespace axlecast {
namespace {

constexpr std::string_view kFileHead = "axlecast-key-1 ";
constexpr std::size_t kSeedBytes = crypto_sign_SEEDBYTES;

static_assert(crypto_sign_PUBLICKEYBYTES == sizeof(PublicKey));
static_assert(crypto_sign_BYTES == sizeof(Signature));

std::string_view Prefix(Domain domain) {
  switch (domain) {
    case Domain::kCommand:
      return "axlecast-command-1";
    case Domain::kStatus:
      return "axlecast-status-1";
    case Domain::kOrder:
      return "axlecast-order-1";
    case Domain::kDriver:
      return "axlecast-driver-1";
    case Domain::kPermit:
      return "axlecast-permit-1";
  }
  return "";
}

std::vector<std::uint8_t> Prefixed(Domain domain, Bytes message) {
  const std::string_view prefix = Prefix(domain);
  std::vector<std::uint8_t> bytes(prefix.begin(), prefix.end());
  bytes.insert(bytes.end(), message.begin(), message.end());
  return bytes;
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

}  // namespace axlecast
