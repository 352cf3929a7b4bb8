#include "tools/axlecast/setup/key_report.h"

#include "core/base/spelling.h"
#include "core/base/text.h"
#include "core/command/keys.h"
#include "core/command/signature.h"
#include "core/messages/lcm_url.h"
#include "tools/axlecast/setup/new_keys.h"

namespace axlecast {
namespace {

using Json = nlohmann::ordered_json;

std::string PlaceText(const SecretPlace& place) {
  if (!place.file.empty()) return "secret in " + place.file;
  if (!place.credential.empty()) return "secret in credential " + place.credential;
  return "secret not on this host";
}

std::string OwnText(const std::string& what, const OwnKey& own, const std::string& without) {
  return "    " + Left(what, 10) + ' ' +
         (own.public_key ? KeyIdText(*own.public_key) + "  " + PlaceText(own.place) : "no key: " + without) + '\n';
}

std::string GrantText(const KeyGrant& grant) {
  return "    key " + Left(grant.name, 24) + ' ' + KeyIdText(grant.key) + "  " +
         Left(std::string(RoleName(grant.role)), 10) + " devices " +
         (grant.devices.empty() ? "all" : Listed(grant.devices)) + "; operations " +
         (grant.operations.empty() ? "all of the role" : Listed(grant.operations)) +
         (grant.place.empty() ? "" : "; " + PlaceText(grant.place)) + '\n';
}

Json PlaceJson(const SecretPlace& place) {
  return {{"file", place.file.empty() ? Json() : Json(place.file)},
          {"credential", place.credential.empty() ? Json() : Json(place.credential)}};
}

Json OwnJson(const OwnKey& own) {
  if (!own.public_key) return nullptr;
  Json json = {{"public", KeyText(*own.public_key)}, {"key_id", KeyIdText(*own.public_key)}};
  json.update(PlaceJson(own.place));
  return json;
}

Json GrantJson(const KeyGrant& grant) {
  Json json = {{"name", grant.name},           {"public", KeyText(grant.key)}, {"key_id", KeyIdText(grant.key)},
               {"role", RoleName(grant.role)}, {"devices", grant.devices},     {"operations", grant.operations}};
  json.update(PlaceJson(grant.place));
  return json;
}

// Where commands need no signature.
std::string UnsignedWarning(const MachineConfig& machine) {
  if (ParseLcmUrl(machine.lcm.command_url).ttl > 0) {
    return "bridge.unsigned_commands is allow and lcm.command_url leaves this host (ttl): anybody on the network "
           "may "
           "command this machine; set ttl=0, or refuse them (docs/keys.md)";
  }
  return "bridge.unsigned_commands is allow: every program on this host may command this machine; refuse them, "
         "with "
         "keys for those who may (docs/keys.md)";
}

}  // namespace

std::vector<std::string> KeyWarnings(const MachineConfig& machine) {
  const BridgeConfig& bridge = machine.bridge;
  if (bridge.allow_unsigned) return {UnsignedWarning(machine)};
  if (bridge.keys.empty()) {
    return {
        "nobody can command this machine: bridge.keys names no key, and unsigned commands are refused; axlecast "
        "keygen --machine " +
        machine.machine + " makes the first keys (docs/keys.md)"};
  }
  std::vector<std::string> warnings;
  if (!bridge.bridge.public_key) {
    warnings.push_back(
        "bridge.key is missing: the drivers obey nothing, because unsigned orders are refused; axlecast "
        "keygen makes one (docs/keys.md)");
  } else if (!bridge.drivers.public_key) {
    warnings.push_back(
        "bridge.drivers is missing: the bridge believes whoever says that he is a driver; axlecast "
        "keygen makes a key for them (docs/keys.md)");
  }
  return warnings;
}

std::string KeysText(const MachineConfig& machine) {
  const BridgeConfig& bridge = machine.bridge;
  const std::string unchecked = bridge.allow_unsigned ? "anybody is believed" : "nothing is obeyed";
  std::string text = "bridge\n    unsigned   " + std::string(bridge.allow_unsigned ? "allowed" : "refused") +
                     "\n    journal    " + JournalFile(machine) + '\n';
  text += OwnText("bridge", bridge.bridge, unchecked);
  text += OwnText("drivers", bridge.drivers, "anybody is believed");
  for (const KeyGrant& grant : bridge.keys) text += GrantText(grant);
  return text;
}

Json KeysJson(const MachineConfig& machine) {
  const BridgeConfig& bridge = machine.bridge;
  Json json = {{"unsigned_commands", bridge.allow_unsigned ? "allow" : "refuse"},
               {"journal", JournalFile(machine)},
               {"key", OwnJson(bridge.bridge)},
               {"drivers", OwnJson(bridge.drivers)},
               {"keys", Json::array()}};
  for (const KeyGrant& grant : bridge.keys) json["keys"].push_back(GrantJson(grant));
  return json;
}

}  // namespace axlecast
