#include "tools/log/shipped_logs.h"

#include <fcntl.h>
#include <sys/file.h>

#include <cerrno>
#include <cstring>
#include <filesystem>
#include <nlohmann/json.hpp>
#include <optional>
#include <set>
#include <system_error>
#include <utility>

#include "core/messages/json/field.h"
#include "platform/os/mapped_file.h"
#include "platform/os/new_file.h"
#include "tools/log/log_event.h"
#include "tools/log/log_holes.h"
#include "tools/log/log_name.h"

namespace axlecast {
namespace {

using Json = nlohmann::ordered_json;

std::string ShippedPath(const std::string& folder) { return folder + "/shipped.json"; }

std::optional<ShippedLog> ParseEntry(const Json& json) {
  if (!json.is_object()) return std::nullopt;
  const auto complete = json.find("complete");
  const std::optional<std::int64_t> upto = JsonCount(json, "upto");
  const std::optional<std::int64_t> hole = json.contains("hole") ? JsonCount(json, "hole") : 0;
  if (!upto || !hole || complete == json.end() || !complete->is_boolean()) return std::nullopt;
  return ShippedLog{*upto, complete->get<bool>(), *hole};
}

}  // namespace

std::optional<std::int64_t> JsonCount(const Json& object, const char* key) {
  const auto found = object.find(key);
  if (found == object.end() || !found->is_number_integer()) return std::nullopt;
  if (found->is_number_unsigned() && found->get<std::uint64_t>() > INT64_MAX) return std::nullopt;
  const auto count = found->get<std::int64_t>();
  return count >= 0 ? std::optional(count) : std::nullopt;
}

ShippedLog ShippedLogs::Of(std::string_view file) const {
  const auto found = logs.find(PlainLogName(file));
  return found == logs.end() ? ShippedLog() : found->second;
}

std::string FormatShippedLogs(const ShippedLogs& shipped) {
  Json logs = Json::object();
  for (const auto& [file, log] : shipped.logs) {
    Json& entry = logs[file] = {{"upto", log.upto}, {"complete", log.complete}};
    if (log.hole != 0) entry["hole"] = log.hole;
  }
  return JsonLine({{"logs", std::move(logs)}, {"utime", shipped.utime}}) + '\n';
}

Result<ShippedLogs> ParseShippedLogs(std::string_view text) {
  const Json json = ParseOutsideJson(text);
  const auto bad = [](const std::string& what) { return Failure("is damaged (" + what + ")"); };
  if (!json.is_object()) return bad("it is not one JSON object");
  const auto logs = json.find("logs");
  const std::optional<std::int64_t> utime = JsonCount(json, "utime");
  if (logs == json.end() || !logs->is_object() || !utime) return bad("logs or utime");
  ShippedLogs shipped;
  shipped.utime = *utime;
  for (const auto& [file, entry] : logs->items()) {
    const std::optional<ShippedLog> log = ParseEntry(entry);
    if (!log) return bad("the entry of a log");
    shipped.logs.insert_or_assign(file, *log);
  }
  return shipped;
}

Result<ShippedLogs> ReadShippedLogs(const std::string& folder) {
  const std::string path = ShippedPath(folder);
  std::error_code error;
  if (std::filesystem::symlink_status(path, error).type() == std::filesystem::file_type::not_found)
    return ShippedLogs();
  const MappedFile file(path);
  if (!file.problem().empty()) return Failure(file.problem());
  Result<ShippedLogs> shipped = ParseShippedLogs(AsText(file.bytes()));
  if (shipped) return shipped;
  return Failure(path + ' ' + shipped.error().text +
                 ": nothing counts as shipped until `axlecast ship` writes it again");
}

Result<> MarkShipped(const std::string& folder, const ShippedLogs& changed) {
  const Result<Descriptor> lock = LockOutbox(folder);
  if (!lock) return Failure(lock.error());
  const Result<std::set<std::string>> holes = LogsOfHoles(folder);
  if (!holes) return Failure(holes.error());
  ShippedLogs shipped = ReadShippedLogs(folder).value_or(ShippedLogs());
  for (const auto& [file, log] : changed.logs) shipped.logs.insert_or_assign(file, log);
  std::erase_if(shipped.logs, [&](const auto& entry) {
    return !LogExists(folder, entry.first) && !holes->contains(entry.first);
  });
  shipped.utime = changed.utime;
  return WriteNewFile(ShippedPath(folder), FormatShippedLogs(shipped), {.mode = 0644}, true);
}

Result<Descriptor> LockOutbox(const std::string& folder) {
  Descriptor lock(open(folder.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC));
  if (!lock.valid()) return Failure(folder + ": " + std::strerror(errno));
  if (flock(lock.get(), LOCK_EX | LOCK_NB) == 0) return lock;
  return Failure(folder + ": " + (errno == EWOULDBLOCK ? "is locked by another process" : std::strerror(errno)));
}

}  // namespace axlecast
