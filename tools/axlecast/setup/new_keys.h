#pragma once

#include <optional>
#include <string>
#include <vector>

#include "core/command/keys.h"
#include "platform/os/new_file.h"

namespace axlecast {

// The public half of a key file.
struct KeyFile {
  std::string name;  // as it shall stand in the machine's file
  std::string file;  // absolute
  PublicKey key{};
  FileAccess access = {};  // of a new file
};

// The files of a machine: bridge.key, drivers.key and local.key in `directory`.
[[nodiscard]] std::vector<KeyFile> MachineKeyFiles(const std::string& directory);

using GroupFinder = std::optional<gid_t> (*)(const std::string& name);
// Sets who may read a machine's files beside their owner: each process its own key (accounts of the package; where they do
// not exist, nobody), and the group `operators` local.key, if given. No process may read local.key.
void GiveToReaders(std::vector<KeyFile>& files, std::optional<gid_t> operators, GroupFinder find = &FindGroup);

// Where they stand: /etc/axlecast/<machine> for root, else $XDG_CONFIG_HOME/axlecast/<machine> (~/.config).
[[nodiscard]] std::string KeyDirectory(const std::string& machine);

// Writes a new key into each file, or into none: an empty string, else the cause and the remedy. Fills in `key`.
[[nodiscard]] std::string WriteKeys(std::vector<KeyFile>& files, bool replace);

// Reads them instead.
[[nodiscard]] std::string ReadKeys(std::vector<KeyFile>& files);

// For the machine's file: the line below bridge.keys, or the whole of `bridge` from MachineKeyFiles.
[[nodiscard]] std::string GrantLine(const KeyFile& key, const std::string& role);
[[nodiscard]] std::string BridgeBlock(const std::vector<KeyFile>& files);

// command_body_t.key_id in hex, as refusals name it.
[[nodiscard]] std::string KeyIdText(const PublicKey& key);

}  // namespace axlecast
