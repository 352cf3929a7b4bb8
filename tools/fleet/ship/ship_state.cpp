#include "tools/fleet/ship/ship_state.h"

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstdlib>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <nlohmann/json.hpp>
#include <optional>
#include <regex>

#include "core/base/text.h"
#include "platform/os/new_file.h"
#include "platform/os/process.h"

namespace axlecast {
namespace {

constexpr std::size_t kMaxNames = 100;

bool IsUuid(const std::string& text) {
  static const std::regex kUuid("[0-9a-f]{8}-[0-9a-f]{4}-[0-9a-f]{4}-[0-9a-f]{4}-[0-9a-f]{12}");
  return std::regex_match(text, kUuid);
}

std::string Variable(const char* name) {
  const char* const value = std::getenv(name);
  return value == nullptr ? "" : value;
}

}  // namespace

std::string NewInstallationId() {
  std::array<std::uint8_t, 16> id = RandomId();
  id[6] = static_cast<std::uint8_t>((id[6] & 0x0FU) | 0x40U);  // version 4
  id[8] = static_cast<std::uint8_t>((id[8] & 0x3FU) | 0x80U);  // variant of RFC 4122
  std::string text = HexDigits(id);
  for (const std::size_t dash : {8U, 13U, 18U, 23U}) text.insert(dash, "-");
  return text;
}

std::string FormatInstallation(const Installation& installation) {
  const nlohmann::ordered_json json = {{"installation", installation.id}, {"names", installation.names}};
  return json.dump() + '\n';
}

Result<Installation> ParseInstallation(std::string_view text) {
  const nlohmann::json json = nlohmann::json::parse(text, nullptr, false);
  const auto wrong = [] {
    return Failure("is not the file of an installation: {\"installation\":UUID,\"names\":[…]}");
  };
  if (!json.is_object() || !json.contains("installation") || !json.contains("names")) return wrong();
  if (!json["installation"].is_string() || !json["names"].is_array() || json["names"].size() > kMaxNames)
    return wrong();
  Installation installation{.id = json["installation"].get<std::string>(), .names = {}};
  if (!IsUuid(installation.id)) return wrong();
  for (const auto& name : json["names"]) {
    if (!name.is_string()) return wrong();
    installation.names.push_back(name.get<std::string>());
  }
  return installation;
}

std::string DefaultShipState() {
  if (std::string folder = Variable("STATE_DIRECTORY"); !folder.empty()) return folder;
  if (const std::string folder = Variable("XDG_STATE_HOME"); !folder.empty()) return folder + "/axlecast/ship";
  return Variable("HOME") + "/.local/state/axlecast/ship";
}

Result<> ShipState::Open(const std::string& folder) {
  if (const Result<> made = MakeFolders(folder, 0700); !made) {
    return Failure(made.error().text + "; create the folder, or choose another with --state");
  }
  if (const Result<> locked = lock_.Acquire(folder + "/.lock"); !locked) {
    return Failure(locked.error().text +
                   ": another `axlecast ship` uses this state folder; stop it, or give each machine of this "
                   "host its own --state");
  }
  file_ = folder + "/installation.json";
  std::ifstream in(file_, std::ios::binary);
  if (!in) {
    if (errno != ENOENT) return Failure(file_ + ": " + std::strerror(errno));
    const Installation fresh{.id = NewInstallationId(), .names = {}};
    if (Result<> saved = Save(fresh); !saved) return saved;
    installation_ = fresh;
    return {};
  }
  const std::string text{std::istreambuf_iterator<char>(in), {}};
  const Result<Installation> read = ParseInstallation(text);
  if (!read) {
    return Failure(file_ + ' ' + read.error().text +
                   "; restore it from a backup, or remove it, and run `axlecast fleet adopt`");
  }
  installation_ = *read;
  return {};
}

Result<> ShipState::AddName(const std::string& name) {
  if (std::ranges::find(installation_.names, name) != installation_.names.end()) return {};
  Installation changed = installation_;
  changed.names.push_back(name);
  if (Result<> saved = Save(changed); !saved) return saved;
  installation_ = changed;
  return {};
}

Result<> ShipState::Save(const Installation& installation) const {
  return WriteNewFile(file_, FormatInstallation(installation), {.mode = 0600}, true);
}

}  // namespace axlecast
