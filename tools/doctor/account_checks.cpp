#include "tools/doctor/account_checks.h"

#include <algorithm>
#include <array>

#include "core/base/text.h"

namespace axlecast {
namespace {

constexpr const char* kBridgeAccount = "axlecast-bridge";
constexpr std::array<const char*, 6> kAccounts = {kBridgeAccount, kDriversAccount, "axlecast-record",
                                                  "axlecast-web", "axlecast-mqtt", "axlecast-multicast"};
constexpr std::array<const char*, 3> kDeviceGroups = {"dialout", "spi", "gpio"};
constexpr uid_t kFirstPerson = 1000;  // Debian policy 9.2.2

bool IsAccount(const std::string& name) {
  return std::find(kAccounts.begin(), kAccounts.end(), name) != kAccounts.end();
}

bool GroupMayRead(const HostFile& file) { return (file.mode & 040) != 0; }

const HostFile* FileOf(const std::string& path, const HostFacts& host) {
  const auto file = host.secrets.find(path);
  const bool seen = file != host.secrets.end() && file->second.error == 0;
  return seen ? &file->second : nullptr;
}

// A key of the machine's processes: readable for the account that signs with it, and for no other.
void LookAtOwnKey(const OwnKey& key, const std::string& account, const HostFacts& host, Symptoms& findings) {
  const HostFile* const file = FileOf(key.place.file, host);
  if (file == nullptr || file->uid >= kFirstPerson) return;  // a person's: key_owner
  const bool by_group = GroupMayRead(*file);
  if (by_group ? file->group == account : file->owner == account) return;
  findings.push_back({.found = "the key " + file->path + " can be read by " +
                               (by_group ? "the group " + file->group : file->owner) + ", not by " + account +
                               " alone",
                      .fixes = {Run({"chgrp", account, file->path}), Run({"chmod", "640", file->path})},
                      .safe = true});
}

const std::vector<std::string>& MembersOf(const std::string& group, const HostFacts& host) {
  static const std::vector<std::string> kNobody;
  const auto found = host.groups.find(group);
  return found == host.groups.end() ? kNobody : found->second;
}

Symptom MemberFinding(const std::string& user, const std::string& group, const std::string& what) {
  return {.found = Printable(user) + " is in the group " + group + ", " + what,
          .fixes = {Run({"gpasswd", "--delete", user, group})},
          .safe = false};
}

// A port of the machine: the drivers alone may open it. The members of dialout are looked at by themselves.
void LookAtPort(const PortUse& use, const HostFacts& host, Symptoms& findings) {
  const auto facts = host.ports.find(use.path);
  if (facts == host.ports.end() || facts->second.file.error != 0) return;
  const HostFile& file = facts->second.file;
  const bool by_all = (file.mode & 06) != 0;
  const bool by_group = (file.mode & 060) != 0 && file.group != kDriversAccount && file.group != "root";
  if (!by_all && (!by_group || use.kind == PortUse::Kind::kSerial)) return;
  findings.push_back(
      {.found = file.path + " can be opened by " + (by_all ? "every user" : "the group " + file.group) +
                ": devices can be reached past every interlock",
       .fixes = {by_all ? Run({"chmod", "o=", file.path}) : Run({"chgrp", kDriversAccount, file.path}),
                 Tell("look for the udev rule that opens it: udevadm test $(udevadm info -q path " + file.path +
                      ')')},
       .safe = false});
}

}  // namespace

bool RunsUnderAccounts(const MachineConfig& machine, const HostFacts& host) {
  return host.groups.contains(kDriversAccount) && machine.file.starts_with("/etc/axlecast/");
}

Symptoms CheckKeyAccess(const MachineConfig& machine, const HostFacts& host) {
  Symptoms findings;
  if (!host.groups.contains(kBridgeAccount)) return findings;
  LookAtOwnKey(machine.bridge.bridge, kBridgeAccount, host, findings);
  LookAtOwnKey(machine.bridge.drivers, kDriversAccount, host, findings);
  for (const std::string& path : GrantKeyFiles(machine)) {
    const HostFile* const file = FileOf(path, host);
    if (file == nullptr || !(GroupMayRead(*file) ? IsAccount(file->group) : IsAccount(file->owner))) continue;
    findings.push_back({.found = "the key " + path + " commands, and can be read by the process of " +
                                 (GroupMayRead(*file) ? file->group : file->owner),
                        .fixes = {Run({"chown", "root:root", path}), Run({"chmod", "600", path})},
                        .safe = true});
  }
  return findings;
}

Symptoms CheckGroupMembers(const MachineConfig& machine, const HostFacts& host) {
  Symptoms findings;
  if (host.groups.contains(kDriversAccount)) {
    for (const PortUse& use : PortsOf(machine)) LookAtPort(use, host, findings);
  }
  for (const char* account : kAccounts) {
    for (const std::string& user : MembersOf(account, host)) {
      if (user == account) continue;
      findings.push_back(MemberFinding(user, account, "which is that process's own: its key and its devices"));
    }
  }
  for (const std::string& user : MembersOf(kOperators, host)) {
    if (IsAccount(user)) findings.push_back(MemberFinding(user, kOperators, "which is for persons who command"));
    for (const char* group : kDeviceGroups) {
      const std::vector<std::string>& members = MembersOf(group, host);
      if (IsAccount(user) || std::find(members.begin(), members.end(), user) == members.end()) continue;
      findings.push_back(MemberFinding(user, group, "and commands: devices can be reached past every interlock"));
    }
  }
  return findings;
}

}  // namespace axlecast
