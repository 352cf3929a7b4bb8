#include "client/machine/machine_clients.h"

#include <string>
#include <vector>

#include "client/axlecast/machine_settings.h"
#include "core/base/spelling.h"
#include "core/base/text.h"
#include "core/config/load.h"
#include "platform/os/secret_file.h"

namespace axlecast {
namespace {

// Returns the key of that name, whose secret half can be read.
Result<const KeyGrant*> UsableKey(const MachineConfig& machine, const std::string& name, SecretSource& secrets) {
  const std::string place = machine.file + ": bridge: keys: ";
  std::vector<std::string> names;
  for (const KeyGrant& grant : machine.bridge.keys) {
    names.push_back(grant.name);
    if (grant.name != name) continue;
    const auto key = LoadKey(grant, secrets);
    if (!key) return Failure(key.error());
    if (*key) return &grant;
    return Failure(place + name + ": has no file or credential with its secret half");
  }
  return Failure(place + "has no " + Quoted(name) +
                 (names.empty() ? "; it has none at all" : "; there are " + Listed(names)));
}

}  // namespace

ClientSettings SettingsOf(const MachineConfig& machine) {
  ClientSettings settings;
  settings.command_url = machine.lcm.command_url;
  settings.prefix = machine.lcm.prefix;
  settings.machine = machine.machine;
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

Result<ClientSettings> SettingsOfMachine(const std::string& file, const std::string& key_name) {
  ConfigErrors errors(file);
  const std::optional<MachineConfig> machine = LoadConfig(file, errors);
  if (!machine) return Failure(errors.Text());
  SecretFiles secrets;
  const Result<const KeyGrant*> grant =
      key_name.empty() ? ReadableKey(*machine, std::nullopt, secrets) : UsableKey(*machine, key_name, secrets);
  if (!grant) return Failure(grant.error());
  ClientSettings settings = SettingsOf(*machine);
  if (*grant != nullptr) {
    settings.key_file = (*grant)->place.file;
    settings.key_credential = (*grant)->place.credential;
  }
  return settings;
}

}  // namespace axlecast
