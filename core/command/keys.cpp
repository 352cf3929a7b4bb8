#include "core/command/keys.h"

#include "core/base/result.h"

namespace axlecast {
namespace {

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
