#include "core/command/keys.h"

namespace axlecast {
namespace {

std::string NameOf(const SecretPlace& place) {
  return place.file.empty() ? "credential '" + place.credential + '\'' : place.file;
}

std::optional<SigningKey> Load(const SecretPlace& place, SecretSource& secrets, std::string& problem) {
  problem.clear();
  if (place.empty()) return std::nullopt;
  Secret text;
  problem = secrets.Read(place, text);
  if (!problem.empty()) return std::nullopt;
  std::optional<SigningKey> key = SigningKey::Parse(text.text());
  if (!key) {
    problem = NameOf(place) + " is no key: axlecast keygen FILE writes one (docs/keys.md)";
  }
  return key;
}

std::optional<SigningKey> LoadHalf(const SecretPlace& place, const std::optional<PublicKey>& configured,
                                   SecretSource& secrets, std::string& problem) {
  std::optional<SigningKey> key = Load(place, secrets, problem);
  if (!key || !configured || key->public_key() == *configured) return key;
  problem = NameOf(place) + " holds another key than the machine's file names: its public key is " +
            KeyText(key->public_key()) + ", in the machine's file stands " + KeyText(*configured) +
            "; put the first there, or the right key into the place";
  return std::nullopt;
}

}  // namespace

std::string_view RoleName(Role role) { return kRoleNames.at(static_cast<std::size_t>(role)); }

bool MayOrder(Role role, const OperationSpec& operation) {
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

std::string_view RolesThatMayOrder(const OperationSpec& operation) {
  if (operation.destructive) return "maintainer";
  return operation.reads_only ? "observer, operator, control or maintainer" : "operator, control or maintainer";
}

std::optional<SigningKey> LoadKey(const OwnKey& own, SecretSource& secrets, std::string& problem) {
  return LoadHalf(own.place, own.public_key, secrets, problem);
}

std::optional<SigningKey> LoadKey(const KeyGrant& grant, SecretSource& secrets, std::string& problem) {
  return LoadHalf(grant.place, grant.key, secrets, problem);
}

std::optional<SigningKey> LoadKeyFile(const std::string& path, SecretSource& secrets, std::string& problem) {
  if (path.empty()) {
    problem = "no key file is named";
    return std::nullopt;
  }
  return Load({.file = path, .credential = {}, .group_may_read = true}, secrets, problem);
}

}  // namespace axlecast
