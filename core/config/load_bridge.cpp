#include <algorithm>

#include "core/base/spelling.h"
#include "core/command/commands.h"
#include "core/command/keys.h"
#include "core/config/config_map.h"
#include "core/config/load.h"

namespace axlecast {
namespace {

constexpr const char* kUnsignedName = "unsigned";  // what the journal calls a sender without a key

class BridgeLoader {
 public:
  explicit BridgeLoader(const DeviceFamilies& devices) : devices_(devices) {}

  BridgeConfig Load(ConfigMap& map) {
    bridge_.allow_unsigned = map.Choice("unsigned_commands", {"allow", "refuse"}, 1) == 0;
    bridge_.journal = map.File("journal", "/var/lib/axlecast/journal.db");
    bridge_.bridge = LoadOwn(map, "key");
    bridge_.drivers = LoadOwn(map, "drivers");
    if (map.Has("drivers") && !map.Has("key")) {
      map.Error("drivers", "needs key beside it: drivers that sign obey a bridge that signs");
    }
    for (auto& [name, grant] : map.Maps("keys")) LoadGrant(name, grant);
    map.Done();
    return std::move(bridge_);
  }

 private:
  // Reads 64 hex digits. A key may be given only once in the file.
  std::optional<PublicKey> LoadPublic(ConfigMap& map) {
    const std::string text = map.RequiredString("public");
    if (!map.Has("public")) return std::nullopt;
    const std::optional<PublicKey> key = ParsePublicKey(text);
    if (!key) {
      map.Error("public", Quoted(text) + " is no public key: 64 hex digits, as axlecast keygen prints them");
      return std::nullopt;
    }
    const auto [first, added] = taken_.emplace(KeyId(*key), map.path());
    if (!added) map.Error("public", "is the key of " + first->second + " already: each has a key of its own");
    return key;
  }

  static SecretPlace LoadKeyPlace(ConfigMap& map, const std::string& name) {
    SecretPlace place = LoadPlace(map, "/etc/axlecast/" + name + ".key");
    place.group_may_read = true;
    return place;
  }

  OwnKey LoadOwn(ConfigMap& bridge, const std::string& name) {
    OwnKey own;
    if (!bridge.Has(name)) return own;
    ConfigMap map = bridge.Map(name);
    own.public_key = LoadPublic(map);
    own.place = LoadKeyPlace(map, name == "key" ? "bridge" : name);
    map.Done();
    return own;
  }

  void LoadGrant(const std::string& name, ConfigMap& map) {
    KeyGrant grant;
    grant.name = name;
    map.CheckName(name);
    if (name == kUnsignedName) map.ErrorHere("is what the journal calls senders without a key: another name");
    if (const auto key = LoadPublic(map)) {
      grant.key = *key;
      grant.id = KeyId(*key);
    }
    const std::vector<std::string_view> roles(kRoleNames.begin(), kRoleNames.end());
    map.Require("role", "one of " + Listed({kRoleNames.begin(), kRoleNames.end()}));
    grant.role = static_cast<Role>(map.Choice("role", roles, 0));
    grant.devices = LoadDevices(map);
    grant.operations = LoadOperations(map, grant);
    grant.place = LoadKeyPlace(map, name);
    map.Done();
    bridge_.keys.push_back(std::move(grant));
  }

  [[nodiscard]] std::vector<std::string> LoadDevices(ConfigMap& map) const {
    std::vector<std::string> known;
    for (const auto& [device, family] : devices_) known.push_back(device);
    std::vector<std::string> devices = map.Strings("devices");
    for (const std::string& device : devices) {
      if (devices_.contains(device)) continue;
      map.Error("devices", Quoted(device) + " is no device of this machine" +
                               Suggestion(device, known, "; known here: " + Listed(known)));
    }
    return devices;
  }

  // The families of the grant's devices; nothing where this process does not know all of them.
  [[nodiscard]] std::optional<std::vector<const Family*>> FamiliesOf(const KeyGrant& grant) const {
    std::vector<const Family*> families;
    for (const auto& [device, family] : devices_) {
      const auto& named = grant.devices;
      if (!named.empty() && std::find(named.begin(), named.end(), device) == named.end()) continue;
      if (family == nullptr) return std::nullopt;
      families.push_back(family);
    }
    return families;
  }

  static std::vector<std::string> NamesIn(const std::vector<const Family*>& families) {
    std::vector<std::string> names;
    const auto add = [&](std::span<const OperationSpec> operations) {
      for (const OperationSpec& operation : operations) {
        if (!operation.internal) names.emplace_back(operation.name);
      }
    };
    for (const Family* family : families) {
      add(family->operations);
      add(RuntimeOperations(*family));
    }
    std::sort(names.begin(), names.end());
    names.erase(std::unique(names.begin(), names.end()), names.end());
    return names;
  }

  // A key of role control issues permits for what it may not order itself.
  static bool CanUse(Role role, const std::string& name, const std::vector<const Family*>& families) {
    return role == Role::kControl || std::any_of(families.begin(), families.end(), [&](const Family* family) {
             const OperationSpec* operation = FindOperation(*family, name);
             return operation != nullptr && IsAllowed(role, *operation);
           });
  }

  [[nodiscard]] std::vector<std::string> LoadOperations(ConfigMap& map, const KeyGrant& grant) const {
    std::vector<std::string> operations = map.Strings("operations");
    const auto families = FamiliesOf(grant);
    if (!families || families->empty()) return operations;
    const std::vector<std::string> known = NamesIn(*families);
    for (const std::string& name : operations) {
      if (std::find(known.begin(), known.end(), name) == known.end()) {
        map.Error("operations", "no device of this grant has an operation " + Quoted(name) +
                                    Suggestion(name, known, "; known here: " + Listed(known)));
      } else if (!CanUse(grant.role, name, *families)) {
        map.Error("operations", Quoted(name) + " is not for role " + std::string(RoleName(grant.role)) +
                                    ": leave it out, or give the key another role");
      }
    }
    return operations;
  }

  const DeviceFamilies& devices_;
  BridgeConfig bridge_;
  std::map<std::int64_t, std::string> taken_;  // key id -> its place in the file
};

}  // namespace

BridgeConfig LoadBridge(ConfigMap map, const DeviceFamilies& devices) { return BridgeLoader(devices).Load(map); }

}  // namespace axlecast
