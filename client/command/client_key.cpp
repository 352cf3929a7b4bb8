#include "client/command/client_key.h"

#include <algorithm>
#include <memory>
#include <vector>

#include "core/base/result.h"
#include "core/base/spelling.h"
#include "core/command/keys.h"
#include "core/config/load.h"
#include "platform/os/secret_file.h"

namespace axlecast {
namespace {

const KeyGrant* FindKey(const MachineConfig& machine, const std::string& name, std::string& error) {
  std::vector<std::string> names;
  for (const KeyGrant& grant : machine.bridge.keys) {
    if (grant.name == name) return &grant;
    names.push_back(grant.name);
  }
  error = machine.file + ": bridge: keys: has no " + Quoted(name) +
          (names.empty() ? "; it has none at all" : "; there are " + Listed(names));
  return nullptr;
}

}  // namespace

Result<ClientKeys> LoadClientKeys(const ClientSettings& settings, SecretSource& secrets) {
  ClientKeys keys;
  if (!settings.bridge_key.empty()) {
    keys.bridge = ParsePublicKey(settings.bridge_key);
    if (!keys.bridge) return Failure("the bridge's key " + Quoted(settings.bridge_key) + " is not 64 hex digits");
  }
  if (!settings.key_file.empty()) {
    Result<SigningKey> own = LoadKeyFile(settings.key_file, secrets);
    if (!own) return Failure(own.error());
    keys.own = std::make_shared<const SigningKey>(std::move(*own));
  } else if (!settings.key_credential.empty()) {
    OwnKey place;
    place.place.credential = settings.key_credential;
    Result<std::optional<SigningKey>> own = LoadKey(place, secrets);
    if (!own) return Failure(own.error());
    if (*own) keys.own = std::make_shared<const SigningKey>(std::move(**own));
  }
  return keys;
}

ClientSettings SettingsOf(const MachineConfig& machine) {
  ClientSettings settings;
  settings.command_url = machine.lcm.command_url;
  settings.prefix = machine.lcm.prefix;
  if (machine.bridge.bridge.public_key) settings.bridge_key = KeyText(*machine.bridge.bridge.public_key);
  return settings;
}

const KeyGrant* ReadableKey(const MachineConfig& machine, std::optional<Role> role, SecretSource& secrets) {
  for (const KeyGrant& grant : machine.bridge.keys) {
    if (role && grant.role != *role) continue;
    if (const auto key = LoadKey(grant, secrets); key && *key) return &grant;
  }
  return nullptr;
}

std::optional<ClientSettings> ClientSettings::OfMachine(const std::string& file, const std::string& key_name,
                                                        std::string& error) {
  error.clear();
  ConfigErrors errors(file);
  const std::optional<MachineConfig> machine = LoadConfig(file, errors);
  if (!machine) {
    error = errors.Text();
    return std::nullopt;
  }
  SecretFiles secrets;
  const KeyGrant* grant =
      key_name.empty() ? ReadableKey(*machine, std::nullopt, secrets) : FindKey(*machine, key_name, error);
  if (grant != nullptr && !key_name.empty()) {
    const auto key = LoadKey(*grant, secrets);
    error = ErrorText(key);
    if (key && !*key) {
      error = machine->file + ": bridge: keys: " + key_name + ": says no file or credential with its secret half";
    }
  }
  if (!error.empty()) return std::nullopt;
  ClientSettings settings = SettingsOf(*machine);
  if (grant != nullptr) {
    settings.key_file = grant->place.file;
    settings.key_credential = grant->place.credential;
  }
  return settings;
}

}  // namespace axlecast
