#include "tools/axlecast/common/subcommands.h"

#include <unistd.h>

#include <CLI/CLI.hpp>
#include <cstdlib>
#include <filesystem>
#include <iostream>
#include <memory>
#include <nlohmann/json.hpp>
#include <system_error>

#include "core/base/result.h"
#include "core/base/spelling.h"
#include "core/base/text.h"
#include "core/command/keys.h"
#include "core/messages/json/field.h"
#include "platform/os/folder.h"
#include "platform/os/secret_file.h"
#include "tools/axlecast/common/terminal.h"
#include "tools/axlecast/setup/new_keys.h"

namespace axlecast {
namespace {

std::string Environment(const char* name) {
  const char* const value = std::getenv(name);
  return value == nullptr ? "" : value;
}

// Quotes the path if YAML could read it as another value.
std::string YamlText(const std::string& text) {
  constexpr const char* kPlain = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789_-./";
  if (!text.empty() && text.find_first_not_of(kPlain) == std::string::npos) return text;
  std::string quoted = "'";
  for (const char c : text) quoted += c == '\'' ? "''" : std::string(1, c);
  return quoted + "'";
}

// {public: ..., more, file: ...}
std::string Mapping(const KeyFile& key, const std::string& more) {
  return "{public: " + KeyText(key.key) + more + ", file: " + YamlText(key.file) + "}";
}

// Fails if one of the files exists.
Result<> CheckAbsent(const std::vector<KeyFile>& files) {
  for (const KeyFile& file : files) {
    std::error_code error;
    if (std::filesystem::exists(std::filesystem::symlink_status(file.file, error))) {
      return Failure(
          file.file +
          " exists already: --show prints its public half; --force replaces it, and the new public half must "
          "then be entered wherever the old one is used");
    }
  }
  return {};
}

}  // namespace

std::vector<KeyFile> MachineKeyFiles(const std::string& directory) {
  std::vector<KeyFile> files;
  for (const char* name : {"bridge", "drivers", "local"})
    files.push_back({name, directory + '/' + name + ".key", {}});
  return files;
}

void GiveToReaders(std::vector<KeyFile>& files, std::optional<gid_t> operators, GroupFinder find) {
  for (KeyFile& file : files) {
    const std::optional<gid_t> group = file.name == "local" ? operators : find("axlecast-" + file.name);
    if (group) file.access = {.mode = 0640, .group = group};
  }
}

std::string KeyDirectory(const std::string& machine) {
  if (geteuid() == 0) return "/etc/axlecast/" + machine;
  const std::string config = Environment("XDG_CONFIG_HOME");
  return (config.empty() ? Environment("HOME") + "/.config" : config) + "/axlecast/" + machine;
}

Result<> WriteKeys(std::vector<KeyFile>& files, bool replace) {
  if (!replace) {
    if (Result<> absent = CheckAbsent(files); !absent) return absent;
  }
  for (std::size_t i = 0; i < files.size(); ++i) {
    const SigningKey key = SigningKey::Generate();
    const Secret text(key.FileText());
    Result<> written = WriteNewFile(files[i].file, text.text(), files[i].access, replace);
    files[i].key = key.public_key();
    if (written) continue;
    // Replaced files cannot be restored; new files are removed.
    for (std::size_t made = 0; made < i && !replace; ++made) unlink(files[made].file.c_str());
    return written;
  }
  return {};
}

Result<> ReadKeys(std::vector<KeyFile>& files) {
  SecretFiles secrets;
  for (KeyFile& file : files) {
    const Result<SigningKey> key = LoadKeyFile(file.file, secrets);
    if (!key) return Failure(key.error());
    file.key = key->public_key();
  }
  return {};
}

std::string GrantLine(const KeyFile& key, const std::string& role) {
  return "    " + key.name + ": " + Mapping(key, ", role: " + role) + '\n';
}

std::string BridgeBlock(const std::vector<KeyFile>& files) {
  return "bridge:\n  unsigned_commands: refuse\n  key: " + Mapping(files.at(0), "") +
         "\n  drivers: " + Mapping(files.at(1), "") + "\n  keys:\n" + GrantLine(files.at(2), "maintainer");
}

std::string KeyIdText(const PublicKey& key) { return Text("%016llx", static_cast<unsigned long long>(KeyId(key))); }

namespace {

struct KeygenOptions {
  std::string file;
  std::string machine;
  std::string directory;
  std::string group;
  std::string role = "operator";
  bool show = false;
  bool force = false;
  bool json = false;
};

constexpr const char* kExamples =
    "The secret half stays in the file; the public half and the key id are no secret. The meaning of\n"
    "the keys, step by step: docs/keys.md.\n"
    "Exit code: 0 done, 1 a file exists, cannot be written or read, or contains no key, 2 usage.\n"
    "\n"
    "Examples:\n"
    "  sudo axlecast keygen --machine press3    # the first keys of a machine, and its `bridge:`\n"
    "  axlecast keygen ~/.config/axlecast/anna.key --role maintainer    # a key for another person\n"
    "  axlecast keygen --show /etc/axlecast/press3/local.key\n"
    "  axlecast keygen --show --machine press3 --json | jq -r '.keys[].public'";

// Returns the file's stem if it is valid as a name.
std::string NameOf(const std::string& file) {
  const std::string stem = std::filesystem::path(file).stem().string();
  return IsName(stem) ? stem : "NAME";
}

Result<> CheckUsage(const KeygenOptions& options) {
  if (options.file.empty() == options.machine.empty()) {
    return Failure("give a FILE, or --machine MACHINE for its three keys");
  }
  if (!options.machine.empty() && !IsName(options.machine)) {
    return Failure("--machine: " + Quoted(options.machine) + kNameRule);
  }
  if (options.machine.empty() && !options.directory.empty()) return Failure("--directory needs --machine");
  if (options.show && (options.force || !options.group.empty())) {
    return Failure("--show writes nothing: no --force, no --group");
  }
  return {};
}

std::vector<KeyFile> FilesOf(const KeygenOptions& options) {
  const auto absolute = [](const std::string& path) {
    return std::filesystem::absolute(path).lexically_normal().string();
  };
  if (options.machine.empty()) return {{NameOf(options.file), absolute(options.file), {}}};
  const std::string& given = options.directory;
  return MachineKeyFiles(absolute(given.empty() ? KeyDirectory(options.machine) : given));
}

// Each key file has its own access rights; the directory of a user is private.
Result<> MakeDirectory(const std::string& path) {
  std::error_code error;
  const bool existed = std::filesystem::exists(path, error);
  if (Result<> made = MakeFolders(path, 0777); !made) return made;
  if (!existed) std::filesystem::permissions(path, std::filesystem::perms(geteuid() == 0 ? 0755 : 0700), error);
  if (error) return Failure(path + ": " + error.message());
  return {};
}

std::optional<gid_t> NoGroup(const std::string& /*name*/) { return std::nullopt; }

Result<> Write(const KeygenOptions& options, std::vector<KeyFile>& files) {
  std::optional<gid_t> group;
  if (!options.group.empty()) {
    group = FindGroup(options.group);
    if (!group) {
      return Failure("there is no group " + Quoted(options.group) + "; as root: groupadd --system " +
                     options.group);
    }
  }
  if (options.machine.empty()) {
    if (group) files[0].access = {.mode = 0640, .group = group};
  } else {
    // Only root can assign a file to a group without being a member.
    GiveToReaders(files, group, geteuid() == 0 ? &FindGroup : &NoGroup);
  }
  const std::string directory = std::filesystem::path(files[0].file).parent_path().string();
  if (Result<> made = MakeDirectory(directory); !made) return made;
  return WriteKeys(files, options.force);
}

std::string YamlOf(const KeygenOptions& options, const std::vector<KeyFile>& files) {
  return options.machine.empty() ? GrantLine(files[0], options.role) : BridgeBlock(files);
}

std::string KeysText(const KeygenOptions& options, const std::vector<KeyFile>& files) {
  std::string text;
  for (const KeyFile& file : files) {
    text +=
        file.file + "\n    public key  " + KeyText(file.key) + "\n    key id      " + KeyIdText(file.key) + '\n';
  }
  text += options.machine.empty() ? "In the machine's file, below bridge: keys:\n" : "In the machine's file:\n";
  return text + '\n' + YamlOf(options, files);
}

nlohmann::ordered_json KeysJson(const KeygenOptions& options, const std::vector<KeyFile>& files) {
  nlohmann::ordered_json keys = nlohmann::ordered_json::array();
  for (const KeyFile& file : files) {
    keys.push_back(
        {{"name", file.name}, {"file", file.file}, {"public", KeyText(file.key)}, {"key_id", KeyIdText(file.key)}});
  }
  return {{"keys", keys}, {"yaml", YamlOf(options, files)}};
}

int Keygen(const KeygenOptions& options) {
  if (const Result<> usage = CheckUsage(options); !usage) {
    return Fail("axlecast keygen: " + usage.error().text, kExitUsage);
  }
  std::vector<KeyFile> files = FilesOf(options);
  const Result<> done = options.show ? ReadKeys(files) : Write(options, files);
  if (!done) return Fail(done.error().text, kExitBad);
  std::cout << (options.json ? JsonLine(KeysJson(options, files)) + '\n' : KeysText(options, files));
  return kExitDone;
}

}  // namespace

void AddKeygenCommand(CLI::App& app, int& exit_code) {
  auto options = std::make_shared<KeygenOptions>();
  CLI::App* command = app.add_subcommand("keygen", "Create the keys that sign commands and statuses");
  command->add_option("FILE", options->file, "File of the secret key: to write, or to read with --show");
  command->add_option("--machine", options->machine,
                      "Instead, bridge.key, drivers.key and local.key of this machine");
  command->add_option(
      "--directory", options->directory,
      "Their folder; default /etc/axlecast/MACHINE for root, else $XDG_CONFIG_HOME/axlecast/MACHINE");
  command->add_option("--group", options->group,
                      "Allow this group to read FILE, or local.key with --machine (mode 0640)");
  command->add_option("--role", options->role, "Role of the key in the line for the machine's file")
      ->check(CLI::IsMember(std::vector<std::string>(kRoleNames.begin(), kRoleNames.end())))
      ->capture_default_str();
  command->add_flag("--show", options->show, "Create no key: print the public half of the existing files");
  command->add_flag("--force", options->force, "Replace existing files");
  command->add_flag("--json", options->json, "Print one object: keys (name, file, public, key_id), yaml");
  command->footer(kExamples);
  command->callback([options, &exit_code] { exit_code = Keygen(*options); });
}

}  // namespace axlecast
