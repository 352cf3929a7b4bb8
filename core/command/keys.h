#pragma once

#include <algorithm>
#include <array>
#include <cstdint>
#include <iterator>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "core/base/inline_bytes.h"
#include "core/base/result.h"
#include "core/base/secret.h"
#include "core/device/operation.h"
#include "core/messages/message.h"

namespace axlecast {

// Ed25519 (RFC 8032), as libsodium has it.
using PublicKey = std::array<std::uint8_t, 32>;
using Signature = std::array<std::uint8_t, 64>;

// The kind of message that is signed. Its text is signed with the bytes, so that a signature is not valid for another kind.
enum class Domain : std::uint8_t {
  kCommand,  // command_t: "axlecast-command-1"
  kStatus,   // command_status_t: "axlecast-status-1"
  kOrder,    // driver_command_t: "axlecast-order-1"
  kDriver,   // driver_status_t: "axlecast-driver-1"
  kPermit,   // permit_t: "axlecast-permit-1"
};

// A secret key. Its memory is overwritten when it is destroyed. Only FileText returns it.
class SigningKey {
 public:
  static SigningKey Generate();
  // Parses the content of a key file: "axlecast-key-1 " and the seed of 32 bytes in hex.
  static std::optional<SigningKey> Parse(std::string_view file_text);

  SigningKey(SigningKey&& other) noexcept;
  SigningKey& operator=(SigningKey&& other) noexcept;
  ~SigningKey();

  [[nodiscard]] const PublicKey& public_key() const { return public_key_; }
  [[nodiscard]] Signature Sign(Domain domain, Bytes message) const;
  [[nodiscard]] std::string FileText() const;  // secret

 private:
  SigningKey() = default;

  std::array<std::uint8_t, 64> secret_{};
  PublicKey public_key_{};
};

[[nodiscard]] bool Verify(const PublicKey& key, Domain domain, Bytes message, const Signature& signature);

// Returns command_body_t.key_id: the first 8 bytes, big-endian, of BLAKE2b-256 of the key; never 0.
[[nodiscard]] std::int64_t KeyId(const PublicKey& key);

// Format and parse a public key as 64 hex digits. A key that cannot verify (no point of the curve's large group) is refused.
[[nodiscard]] std::string KeyText(const PublicKey& key);
[[nodiscard]] std::optional<PublicKey> ParsePublicKey(std::string_view text);

// Functions for a message with its own signature in `sig`: the signature of the message encoded with `sig` 0.
template <typename Message>
[[nodiscard]] std::vector<std::uint8_t> Unsigned(Message message) {
  std::fill(std::begin(message.sig), std::end(message.sig), std::uint8_t{0});
  return Encoded(message);
}

template <typename Message>
void SignMessage(const SigningKey& key, Domain domain, Message& message) {
  const Signature signature = key.Sign(domain, Unsigned(message));
  std::copy(signature.begin(), signature.end(), std::begin(message.sig));
}

template <typename Message>
[[nodiscard]] Signature SignatureOf(const Message& message) {
  Signature signature;
  std::copy(std::begin(message.sig), std::end(message.sig), signature.begin());
  return signature;
}

template <typename Message>
[[nodiscard]] bool VerifyMessage(const PublicKey& key, Domain domain, const Message& message) {
  return Verify(key, domain, Unsigned(message), SignatureOf(message));
}

// What a key may do. Without a key, everybody may query the state of a command.
enum class Role : std::uint8_t {
  kObserver,    // operations that only read
  kOperator,    // and those that are not destructive
  kControl,     // a control process: as an operator, and it issues permits
  kMaintainer,  // and the destructive ones
};

// A key whose signed commands or permits are accepted.
struct KeyGrant {
  std::string name;
  PublicKey key{};
  std::int64_t id = 0;  // KeyId
  Role role = Role::kObserver;
  std::vector<std::string> devices;     // empty: all
  std::vector<std::string> operations;  // empty: all that the role allows; never more than those
  SecretPlace place;                    // of the secret key on this host; empty: it is elsewhere
};

// A key that a process of the machine signs with.
struct OwnKey {
  std::optional<PublicKey> public_key;
  SecretPlace place;
};

// The roles' names in the order of Role.
inline constexpr std::array<std::string_view, 4> kRoleNames = {"observer", "operator", "control", "maintainer"};
[[nodiscard]] std::string_view RoleName(Role role);

// Returns true if a key of this role may command the operation.
[[nodiscard]] bool IsAllowed(Role role, const OperationSpec& operation);

// Returns these roles as text: "operator, control or maintainer".
[[nodiscard]] std::string_view AllowedRoles(const OperationSpec& operation);

// Loads a secret key from its place. Returns nothing if no place is configured. Fails if the place cannot be read, holds no
// key, or holds another key than the secret half of the configured public key. An error never contains the key.
[[nodiscard]] Result<std::optional<SigningKey>> LoadKey(const OwnKey& own, SecretSource& secrets);
[[nodiscard]] Result<std::optional<SigningKey>> LoadKey(const KeyGrant& grant, SecretSource& secrets);

// Loads the key of a file. Does not check its public half.
[[nodiscard]] Result<SigningKey> LoadKeyFile(const std::string& path, SecretSource& secrets);

}  // namespace axlecast
