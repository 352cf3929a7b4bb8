#include "tools/doctor/key_checks.h"

#include <cerrno>

namespace axlecast {
namespace {

constexpr uid_t kFirstPerson = 1000;  // user ids below are the system's (Debian policy 9.2.2)
constexpr mode_t kClosed = 037;       // bits that no key's file may have

// Calls look(file, findings) for each of these files that was looked at.
template <typename Look>
Symptoms ForEachFile(const std::vector<std::string>& paths, const HostFacts& host, Look look) {
  Symptoms findings;
  for (const std::string& path : paths) {
    const auto file = host.secrets.find(path);
    if (file != host.secrets.end()) look(file->second, findings);
  }
  return findings;
}

std::vector<std::string> AllKeyFiles(const MachineConfig& machine) {
  std::vector<std::string> files = OwnKeyFiles(machine);
  for (std::string& file : GrantKeyFiles(machine)) files.push_back(std::move(file));
  return files;
}

void LookAtMode(const HostFile& file, Symptoms& findings) {
  if (file.error != 0 || (file.mode & kClosed) == 0) return;
  const char* const right = (file.mode & 040) != 0 && file.gid != 0 ? "640" : "600";
  findings.push_back({.found = "the key " + file.path + " has mode " + ModeText(file),
                      .fixes = {Run({"chmod", right, file.path})},
                      .safe = true});
}

}  // namespace

Symptoms CheckKeyMissing(const MachineConfig& machine, const HostFacts& host) {
  return ForEachFile(AllKeyFiles(machine), host, [&machine](const HostFile& file, Symptoms& findings) {
    if (file.error != ENOENT && (file.error != 0 || file.kind == HostFile::Kind::kRegular)) return;
    findings.push_back(
        {.found = "the key " + file.path + (file.error == 0 ? " is no regular file" : " does not exist"),
         .fixes = {Tell("bring it back from where it was made, or make all anew: axlecast keygen --machine " +
                        machine.machine + "    # and put what it prints into the machine's file")},
         .safe = false});
  });
}

Symptoms CheckKeyMode(const MachineConfig& machine, const HostFacts& host) {
  return ForEachFile(AllKeyFiles(machine), host, &LookAtMode);
}

Symptoms CheckKeyOwner(const MachineConfig& machine, const HostFacts& host) {
  return ForEachFile(OwnKeyFiles(machine), host, [&host](const HostFile& file, Symptoms& findings) {
    if (file.error != 0 || file.uid < kFirstPerson || file.uid == host.user) return;
    findings.push_back({.found = "the key " + file.path + " of the machine's processes belongs to " + file.owner,
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
           .fixes = {Tell("usermod -aG " + shared->group + " USER    # then log in again")},
           .safe = false}};
}

Symptoms CheckConfigMode(const MachineConfig& machine, const HostFacts& host) {
  const HostFile& file = host.config;
  if (machine.file.empty() || file.error != 0 || ((file.mode & 02) == 0 && !host.config_shared)) return {};
  return {{.found = "the machine's file " + file.path + " has mode " + ModeText(file),
           .fixes = {Run({"chmod", "go-w", file.path})},
           .safe = true}};
}

}  // namespace axlecast
