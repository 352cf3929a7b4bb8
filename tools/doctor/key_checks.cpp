#include "tools/doctor/check.h"

#include <algorithm>
#include <array>
#include <cerrno>

#include "core/base/text.h"

namespace axlecast {
namespace {

constexpr uid_t kFirstPersonalId = 1000;  // user ids below belong to the system (Debian policy 9.2.2)
constexpr mode_t kForbidden = 037;        // mode bits that no key file may have

// Calls look(file, symptoms) for each of these files that has facts.
template <typename Look>
Symptoms ForEachFile(const std::vector<std::string>& paths, const HostFacts& host, Look look) {
  Symptoms symptoms;
  for (const std::string& path : paths) {
    const auto file = host.secrets.find(path);
    if (file != host.secrets.end()) look(file->second, symptoms);
  }
  return symptoms;
}

std::vector<std::string> AllKeyFiles(const MachineConfig& machine) {
  std::vector<std::string> files = OwnKeyFiles(machine);
  for (std::string& file : GrantKeyFiles(machine)) files.push_back(std::move(file));
  return files;
}

constexpr const char* kOperatorGroup = "axlecast";
constexpr const char* kBridgeAccount = "axlecast-bridge";
constexpr std::array<const char*, 8> kAccounts = {kBridgeAccount,  kDriversAccount,     "axlecast-record",
                                                  "axlecast-web",  "axlecast-mqtt",     "axlecast-time",
                                                  "axlecast-sets", "axlecast-multicast"};
constexpr std::array<const char*, 3> kDeviceGroups = {"dialout", "spi", "gpio"};

bool IsAccount(const std::string& name) { return std::ranges::find(kAccounts, name) != kAccounts.end(); }

bool GroupMayRead(const HostFile& file) { return (file.mode & 040) != 0; }

const HostFile* FileOf(const std::string& path, const HostFacts& host) {
  const auto file = host.secrets.find(path);
  const bool seen = file != host.secrets.end() && file->second.error == 0;
  return seen ? &file->second : nullptr;
}

// Checks that only the account that signs with the key can read it.
void LookAtOwnKey(const OwnKey& key, const std::string& account, const HostFacts& host, Symptoms& symptoms) {
  const HostFile* const file = FileOf(key.place.file, host);
  if (file == nullptr || file->uid >= kFirstPersonalId) return;  // the check key_owner reports a key of a person
  const bool by_group = GroupMayRead(*file);
  if (by_group ? file->group == account : file->owner == account) return;
  symptoms.push_back({.found = "the key " + file->path + " can be read by " +
                               (by_group ? "the group " + file->group : file->owner) + ", not only by " + account,
                      .fixes = {Run({"chgrp", account, file->path}), Run({"chmod", "640", file->path})},
                      .safe = true});
}

const std::vector<std::string>& MembersOf(const std::string& group, const HostFacts& host) {
  static const std::vector<std::string> kNone;
  const auto found = host.groups.find(group);
  return found == host.groups.end() ? kNone : found->second;
}

Symptom MemberSymptom(const std::string& user, const std::string& group, const std::string& what) {
  return {.found = Printable(user) + " is in the group " + group + ", " + what,
          .fixes = {Run({"gpasswd", "--delete", user, group})}};
}

// Checks that only the drivers can open a port. Serial ports may belong to dialout, whose members are checked separately.
void LookAtPort(const PortUse& use, const HostFacts& host, Symptoms& symptoms) {
  const auto facts = host.ports.find(use.path);
  if (facts == host.ports.end() || facts->second.file.error != 0) return;
  const HostFile& file = facts->second.file;
  const bool by_all = (file.mode & 06) != 0;
  const bool by_group = (file.mode & 060) != 0 && file.group != kDriversAccount && file.group != "root";
  if (!by_all && (!by_group || use.kind == PortUse::Kind::kSerial)) return;
  symptoms.push_back(
      {.found = file.path + " can be opened by " + (by_all ? "every user" : "the group " + file.group) +
                ": devices can be accessed without any interlock",
       .fixes = {by_all ? Run({"chmod", "o=", file.path}) : Run({"chgrp", kDriversAccount, file.path}),
                 Manual("look for the udev rule that opens it: udevadm test $(udevadm info -q path " + file.path +
                        ')')}});
}

Symptoms CheckKeyMissing(const MachineConfig& machine, const HostFacts& host) {
  return ForEachFile(AllKeyFiles(machine), host, [&machine](const HostFile& file, Symptoms& symptoms) {
    if (file.error != ENOENT && (file.error != 0 || file.kind == HostFile::Kind::kRegular)) return;
    symptoms.push_back(
        {.found = "the key " + file.path + (file.error == 0 ? " is not a regular file" : " does not exist"),
         .fixes = {Manual("restore it from its backup, or create all keys again: axlecast keygen --machine " +
                          machine.machine + "    # and copy its output into the machine file")}});
  });
}

Symptoms CheckKeyMode(const MachineConfig& machine, const HostFacts& host) {
  return ForEachFile(AllKeyFiles(machine), host, [](const HostFile& file, Symptoms& symptoms) {
    if (file.error != 0 || (file.mode & kForbidden) == 0) return;
    const char* const right = (file.mode & 040) != 0 && file.gid != 0 ? "640" : "600";
    symptoms.push_back({.found = "the key " + file.path + " has mode " + ModeText(file),
                        .fixes = {Run({"chmod", right, file.path})},
                        .safe = true});
  });
}

Symptoms CheckKeyOwner(const MachineConfig& machine, const HostFacts& host) {
  return ForEachFile(OwnKeyFiles(machine), host, [&host](const HostFile& file, Symptoms& symptoms) {
    if (file.error != 0 || file.uid < kFirstPersonalId || file.uid == host.user) return;
    symptoms.push_back({.found = "the key " + file.path + " of the machine's processes belongs to " + file.owner,
                        .fixes = {Run({"chown", "root", file.path})},
                        .safe = true});
  });
}

Symptoms CheckKeyPermission(const MachineConfig& machine, const HostFacts& host) {
  if (host.IsRoot()) return {};
  const HostFile* shared = nullptr;
  for (const std::string& path : GrantKeyFiles(machine)) {
    const auto file = host.secrets.find(path);
    if (file == host.secrets.end() || file->second.error != 0) continue;
    if (file->second.readable) return {};
    if ((file->second.mode & 040) != 0 && file->second.gid != 0) shared = &file->second;
  }
  if (shared == nullptr) return {};
  return {{.found =
               "this user can read no key of bridge.keys; the group " + shared->group + " can read " + shared->path,
           .fixes = {Manual("usermod -aG " + shared->group + " USER    # then log in again")}}};
}

Symptoms CheckConfigMode(const MachineConfig& machine, const HostFacts& host) {
  Symptoms symptoms;
  for (const auto& [file, shared] : host.configs) {
    if (file.error != 0 || ((file.mode & 02) == 0 && !shared)) continue;
    const bool included = file.path != machine.file;
    symptoms.push_back({.found = std::string("the ") + (included ? "included file " : "machine file ") + file.path +
                                 " has mode " + ModeText(file),
                        .fixes = {Run({"chmod", "go-w", file.path})},
                        .safe = true});
  }
  return symptoms;
}

Symptoms CheckKeyAccess(const MachineConfig& machine, const HostFacts& host) {
  Symptoms symptoms;
  if (!host.groups.contains(kBridgeAccount)) return symptoms;
  LookAtOwnKey(machine.bridge.bridge, kBridgeAccount, host, symptoms);
  LookAtOwnKey(machine.bridge.drivers, kDriversAccount, host, symptoms);
  for (const std::string& path : GrantKeyFiles(machine)) {
    const HostFile* const file = FileOf(path, host);
    if (file == nullptr || !(GroupMayRead(*file) ? IsAccount(file->group) : IsAccount(file->owner))) continue;
    symptoms.push_back({.found = "the key " + path + " may send commands and can be read by the process of " +
                                 (GroupMayRead(*file) ? file->group : file->owner),
                        .fixes = {Run({"chown", "root:root", path}), Run({"chmod", "600", path})},
                        .safe = true});
  }
  return symptoms;
}

Symptoms CheckGroupMembers(const MachineConfig& machine, const HostFacts& host) {
  Symptoms symptoms;
  if (host.groups.contains(kDriversAccount)) {
    for (const PortUse& use : PortsOf(machine)) LookAtPort(use, host, symptoms);
  }
  for (const char* account : kAccounts) {
    for (const std::string& user : MembersOf(account, host)) {
      if (user == account) continue;
      symptoms.push_back(MemberSymptom(user, account, "which is only for the process, its key and its devices"));
    }
  }
  for (const std::string& user : MembersOf(kOperatorGroup, host)) {
    if (IsAccount(user)) symptoms.push_back(MemberSymptom(user, kOperatorGroup, "which is for operators"));
    for (const char* group : kDeviceGroups) {
      const std::vector<std::string>& members = MembersOf(group, host);
      if (IsAccount(user) || std::ranges::find(members, user) == members.end()) continue;
      symptoms.push_back(
          MemberSymptom(user, group, "and may send commands: devices can be accessed without any interlock"));
    }
  }
  return symptoms;
}

constexpr auto kChecks = std::to_array<Check>({
    {"key_missing", Severity::kError, "the key files exist",
     "The process cannot sign. Its commands or outcomes are rejected.", &CheckKeyMissing},
    {"key_mode", Severity::kError, "the key files are not accessible to others",
     "The key is refused. Anybody who has read it can send commands until it is replaced.", &CheckKeyMode},
    {"key_owner", Severity::kError, "the machine's own keys belong to root or to its service",
     "The bridge and the drivers refuse the key, because its owner could read and change it.", &CheckKeyOwner},
    {"key_access", Severity::kError, "each process can read its own key and no other key",
     "A compromised process can sign as another process; or a process cannot sign.", &CheckKeyAccess},
    {"group_members", Severity::kWarning, "operators are in no group of a process and cannot open devices",
     "Interlocks, limits and the journal can be bypassed.", &CheckGroupMembers},
    {"key_permission", Severity::kWarning, "this user can read a key for commands",
     "Commands of this user are not signed and therefore rejected.", &CheckKeyPermission},
    {"config_mode", Severity::kError, "only authorised users can write the machine file",
     "Any user of this host can add a key and send commands.", &CheckConfigMode},
});

}  // namespace

std::span<const Check> KeyChecks() { return kChecks; }

}  // namespace axlecast
