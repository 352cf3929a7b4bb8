#pragma once

#include <optional>
#include <string>
#include <vector>

#include "core/base/result.h"
#include "core/command/keys.h"
#include "platform/os/new_file.h"

namespace axlecast {

// The public half of a key file.
struct KeyFile {
  std::string name;  // for the machine's file
  std::string file;  // absolute
  PublicKey key{};
  FileAccess access = {};  // of a new file
};

// Returns the files of a machine: bridge.key, drivers.key and local.key in `directory`.
[[nodiscard]] std::vector<KeyFile> MachineKeyFiles(const std::string& directory);

using GroupFinder = std::optional<gid_t> (*)(const std::string& name);
// Sets the groups that may read a machine's files: each process may read its own key, if the package's accounts exist. The
// group `operators` may read local.key, if given. No process may read local.key.
void GiveToReaders(std::vector<KeyFile>& files, std::optional<gid_t> operators, GroupFinder find = &FindGroup);

// Returns the folder of the files: /etc/axlecast/<machine> for root, else $XDG_CONFIG_HOME/axlecast/<machine> (~/.config).
[[nodiscard]] std::string KeyDirectory(const std::string& machine);

// Writes a new key into each file, or into none. Sets `key` of each file.
[[nodiscard]] Result<> WriteKeys(std::vector<KeyFile>& files, bool replace);

// Reads the keys of existing files instead.
[[nodiscard]] Result<> ReadKeys(std::vector<KeyFile>& files);

// Return the text for the machine's file: the line below bridge.keys, or all of `bridge` from MachineKeyFiles.
[[nodiscard]] std::string GrantLine(const KeyFile& key, const std::string& role);
[[nodiscard]] std::string BridgeBlock(const std::vector<KeyFile>& files);

// Returns command_body_t.key_id in hex, as in refusals.
[[nodiscard]] std::string KeyIdText(const PublicKey& key);

}  // namespace axlecast
