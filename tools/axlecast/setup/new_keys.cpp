#include "tools/axlecast/setup/new_keys.h"

#include <unistd.h>

#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <system_error>

#include "core/base/result.h"
#include "core/command/keys.h"
#include "platform/os/secret_file.h"

namespace axlecast {
namespace {

std::string Environment(const char* name) {
  const char* const value = std::getenv(name);
  return value == nullptr ? "" : value;
}

// In quotes where YAML would take the path for something else.
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

std::string Existing(const std::vector<KeyFile>& files) {
  for (const KeyFile& file : files) {
    std::error_code error;
    if (std::filesystem::exists(std::filesystem::symlink_status(file.file, error))) {
      return file.file +
             " exists already: --show prints its public half; --force replaces it, and what knows it must then "
             "be told the new one";
    }
  }
  return "";
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

std::string WriteKeys(std::vector<KeyFile>& files, bool replace) {
  if (!replace) {
    if (std::string problem = Existing(files); !problem.empty()) return problem;
  }
  for (std::size_t i = 0; i < files.size(); ++i) {
    const SigningKey key = SigningKey::Generate();
    const Secret text(key.FileText());
    std::string problem = ErrorText(WriteNewFile(files[i].file, text.text(), files[i].access, replace));
    files[i].key = key.public_key();
    if (problem.empty()) continue;
    // What was replaced cannot come back; what is new goes again.
    for (std::size_t made = 0; made < i && !replace; ++made) unlink(files[made].file.c_str());
    return problem;
  }
  return "";
}

std::string ReadKeys(std::vector<KeyFile>& files) {
  SecretFiles secrets;
  for (KeyFile& file : files) {
    const Result<SigningKey> key = LoadKeyFile(file.file, secrets);
    if (!key) return key.error().text;
    file.key = key->public_key();
  }
  return "";
}

std::string GrantLine(const KeyFile& key, const std::string& role) {
  return "    " + key.name + ": " + Mapping(key, ", role: " + role) + '\n';
}

std::string BridgeBlock(const std::vector<KeyFile>& files) {
  return "bridge:\n  unsigned_commands: refuse\n  key: " + Mapping(files.at(0), "") +
         "\n  drivers: " + Mapping(files.at(1), "") + "\n  keys:\n" + GrantLine(files.at(2), "maintainer");
}

std::string KeyIdText(const PublicKey& key) {
  char text[20];
  std::snprintf(text, sizeof text, "%016llx", static_cast<unsigned long long>(KeyId(key)));
  return text;
}

}  // namespace axlecast
