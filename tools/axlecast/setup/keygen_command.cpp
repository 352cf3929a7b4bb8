#include "tools/axlecast/setup/subcommands.h"

#include <unistd.h>

#include <CLI/CLI.hpp>
#include <filesystem>
#include <iostream>
#include <memory>
#include <nlohmann/json.hpp>
#include <system_error>

#include "core/base/spelling.h"
#include "core/command/keys.h"
#include "core/messages/json/field.h"
#include "tools/axlecast/common/exit_code.h"
#include "tools/axlecast/setup/new_keys.h"

namespace axlecast {
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
    "The secret half stays in the file; the public half and the key id are no secret. What the keys mean, step by\n"
    "step: docs/keys.md.\n"
    "Exit code: 0 done, 1 a file exists, cannot be written or read, or is no key, 2 usage.\n"
    "\n"
    "Examples:\n"
    "  sudo axlecast keygen --machine press3    # the first keys of a machine, and its `bridge:`\n"
    "  axlecast keygen ~/.config/axlecast/anna.key --role maintainer    # a key for one more person\n"
    "  axlecast keygen --show /etc/axlecast/press3/local.key\n"
    "  axlecast keygen --show --machine press3 --json | jq -r '.keys[].public'";

// The file's stem where that can be the key's name.
std::string NameOf(const std::string& file) {
  const std::string stem = std::filesystem::path(file).stem().string();
  return IsName(stem) ? stem : "NAME";
}

std::string Usage(const KeygenOptions& options) {
  if (options.file.empty() == options.machine.empty())
    return "give a FILE, or --machine MACHINE for its three keys";
  if (!options.machine.empty() && !IsName(options.machine))
    return "--machine: " + Quoted(options.machine) + kNameRule;
  if (options.machine.empty() && !options.directory.empty()) return "--directory goes with --machine";
  if (options.show && (options.force || !options.group.empty()))
    return "--show writes nothing: no --force, no --group";
  return "";
}

std::vector<KeyFile> FilesOf(const KeygenOptions& options) {
  const auto absolute = [](const std::string& path) {
    return std::filesystem::absolute(path).lexically_normal().string();
  };
  if (options.machine.empty()) return {{NameOf(options.file), absolute(options.file), {}}};
  const std::string& given = options.directory;
  return MachineKeyFiles(absolute(given.empty() ? KeyDirectory(options.machine) : given));
}

// Its keys protect themselves; the directory of a person is that person's.
std::string MakeDirectory(const std::string& path) {
  std::error_code error;
  const bool made = std::filesystem::create_directories(path, error);
  if (error) return path + ": " + error.message();
  if (made) std::filesystem::permissions(path, std::filesystem::perms(geteuid() == 0 ? 0755 : 0700), error);
  return error ? path + ": " + error.message() : "";
}

std::optional<gid_t> NoGroup(const std::string& /*name*/) { return std::nullopt; }

std::string Write(const KeygenOptions& options, std::vector<KeyFile>& files) {
  std::optional<gid_t> group;
  if (!options.group.empty()) {
    group = FindGroup(options.group);
    if (!group) {
      return "there is no group " + Quoted(options.group) + "; as root: groupadd --system " + options.group;
    }
  }
  if (options.machine.empty()) {
    if (group) files[0].access = {.mode = 0640, .group = group};
  } else {
    // Only root can give a file to a group that he is not in.
    GiveToReaders(files, group, geteuid() == 0 ? &FindGroup : &NoGroup);
  }
  const std::string directory = std::filesystem::path(files[0].file).parent_path().string();
  if (std::string problem = MakeDirectory(directory); !problem.empty()) return problem;
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
  if (const std::string problem = Usage(options); !problem.empty()) {
    std::cerr << "axlecast keygen: " << problem << '\n';
    return kExitUsage;
  }
  std::vector<KeyFile> files = FilesOf(options);
  if (const std::string problem = options.show ? ReadKeys(files) : Write(options, files); !problem.empty()) {
    std::cerr << problem << '\n';
    return kExitBad;
  }
  std::cout << (options.json ? JsonLine(KeysJson(options, files)) + '\n' : KeysText(options, files));
  return kExitDone;
}

}  // namespace

void AddKeygenCommand(CLI::App& app, int& exit_code) {
  auto options = std::make_shared<KeygenOptions>();
  CLI::App* command =
      app.add_subcommand("keygen", "Makes the keys that commands, orders and statuses are signed with");
  command->add_option("FILE", options->file, "Where the secret key shall be, or is with --show");
  command->add_option("--machine", options->machine,
                      "Instead: bridge.key, drivers.key and local.key of this machine");
  command->add_option("--directory", options->directory,
                      "Where those are; else /etc/axlecast/MACHINE for root, $XDG_CONFIG_HOME/axlecast/MACHINE");
  command->add_option("--group", options->group,
                      "Members of this group may read FILE, or with --machine local.key (mode 0640)");
  command->add_option("--role", options->role, "Of FILE's key, in the line for the machine's file")
      ->check(CLI::IsMember(std::vector<std::string>(kRoleNames.begin(), kRoleNames.end())))
      ->capture_default_str();
  command->add_flag("--show", options->show, "Makes none: prints the public half of what is there");
  command->add_flag("--force", options->force, "Replaces files that are there already");
  command->add_flag("--json", options->json, "One object: keys (name, file, public, key_id), yaml");
  command->footer(kExamples);
  command->callback([options, &exit_code] { exit_code = Keygen(*options); });
}

}  // namespace axlecast
