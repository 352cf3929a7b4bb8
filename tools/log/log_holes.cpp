#include "tools/log/log_holes.h"

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <filesystem>
#include <map>
#include <nlohmann/json.hpp>
#include <system_error>
#include <tuple>
#include <utility>

#include "core/messages/json/field.h"
#include "platform/os/descriptor.h"
#include "platform/os/mapped_file.h"
#include "platform/os/new_file.h"
#include "tools/log/log_event.h"
#include "tools/log/log_name.h"
#include "tools/log/log_reader.h"

namespace axlecast {
namespace {

using Json = nlohmann::ordered_json;

std::string HolesPath(const std::string& folder) { return folder + "/holes.jsonl"; }

std::optional<std::string> JsonText(const Json& json, const char* key) {
  const auto found = json.find(key);
  return found != json.end() && found->is_string() ? std::optional(found->get<std::string>()) : std::nullopt;
}

std::vector<LogHole> ParseLines(std::string_view text) {
  std::vector<LogHole> holes;
  for (std::size_t end = text.find('\n'); end != std::string_view::npos; end = text.find('\n')) {
    if (auto hole = ParseHole(text.substr(0, end))) holes.push_back(*std::move(hole));
    text.remove_prefix(end + 1);
  }
  return holes;
}

// Returns the undamaged lines, in the order of the file.
Result<std::vector<LogHole>> ReadLines(const std::string& folder) {
  const std::string path = HolesPath(folder);
  std::error_code error;
  if (std::filesystem::symlink_status(path, error).type() == std::filesystem::file_type::not_found)
    return std::vector<LogHole>();
  const MappedFile file(path);
  if (!file.problem().empty()) return Failure(file.problem());
  return ParseLines(AsText(file.bytes()));
}

// Returns the last line of each log that is gone, in the order of the first lines.
std::vector<LogHole> HolesOf(const std::string& folder, const std::vector<LogHole>& lines) {
  std::vector<LogHole> holes;
  std::map<std::string, std::size_t, std::less<>> places;
  for (const LogHole& line : lines) {
    if (line.logs == 1 && LogExists(folder, line.file)) continue;
    const auto [place, is_new] = places.try_emplace(line.file, holes.size());
    if (is_new) {
      holes.push_back(line);
    } else {
      holes[place->second] = line;
    }
  }
  return holes;
}

bool IsOpen(const LogHole& hole, const ShippedLogs& shipped) {
  const ShippedLog log = shipped.Of(hole.file);
  return !log.complete && log.hole != hole.logs;
}

Result<> WriteLines(const std::string& folder, const std::vector<LogHole>& holes) {
  std::string text;
  for (const LogHole& hole : holes) text += FormatHole(hole);
  return WriteNewFile(HolesPath(folder), text, {.mode = 0644}, true);
}

// Removes the lines of no use. Joins holes if the rest is still large.
Result<> Shorten(const std::string& folder) {
  const Result<std::vector<LogHole>> lines = ReadLines(folder);
  if (!lines) return Failure(lines.error());
  if (const int error = SyncFolderOf(HolesPath(folder)); error != 0)
    return Failure(folder + ": " + std::strerror(error));
  const ShippedLogs shipped = ReadShippedLogs(folder).value_or(ShippedLogs());
  std::vector<LogHole> holes = HolesOf(folder, *lines);
  std::erase_if(holes, [&](const LogHole& hole) { return !IsOpen(hole, shipped); });
  std::size_t bytes = 0;
  for (const LogHole& hole : holes) bytes += FormatHole(hole).size();
  if (bytes > kMaxHolesBytes / 2) holes = JoinHoles(std::move(holes));
  return WriteLines(folder, holes);
}

// Reserves space for later lines without changing the size: a line must also fit if the disk is full, because the deletion that
// frees space needs it first. Not every file system supports this.
void ReserveSpace(const Descriptor& file) {
  static_cast<void>(fallocate(file.get(), FALLOC_FL_KEEP_SIZE, 0, kMaxHolesBytes + kMaxHolesBytes / 2));
}

Descriptor OpenForLines(const std::string& path) {
  return Descriptor(open(path.c_str(), O_RDWR | O_CREAT | O_APPEND | O_NOFOLLOW | O_CLOEXEC, 0644));
}

// Appends the text at `end`, durably. Removes it again if it does not fit.
Result<> AppendText(const Descriptor& file, std::string_view text, off_t end, const std::string& path) {
  const ssize_t written = write(file.get(), text.data(), text.size());
  if (written != static_cast<ssize_t>(text.size())) {
    const int error = written < 0 ? errno : ENOSPC;
    const bool cut = ftruncate(file.get(), end) == 0;
    return Failure(path + ": " + std::strerror(error) + (cut ? "" : "; its last line is incomplete"));
  }
  if (fsync(file.get()) != 0) return Failure(path + ": " + std::strerror(errno));
  const int error = SyncFolderOf(path);
  return error == 0 ? Result<>() : Failure(path + ": " + std::strerror(error));
}

Result<> Withdraw(const std::string& folder) {
  Result<std::vector<LogHole>> lines = ReadLines(folder);
  if (!lines) return Failure(lines.error());
  const std::size_t before = lines->size();
  std::erase_if(*lines, [&](const LogHole& hole) { return hole.logs == 1 && LogExists(folder, hole.file); });
  return lines->size() == before ? Result<>() : WriteLines(folder, *lines);
}

void Join(LogHole& older, const LogHole& hole) {
  older.logs += hole.logs;
  older.bytes += hole.bytes;
  older.last_utime = std::max(older.last_utime, hole.last_utime);
  older.utime = hole.utime;
  older.cause = hole.cause;
}

Result<> AppendLine(const std::string& folder, const LogHole& hole) {
  const std::string path = HolesPath(folder);
  Descriptor file = OpenForLines(path);
  struct stat status {};
  if (!file.valid() || fstat(file.get(), &status) != 0) return Failure(path + ": " + std::strerror(errno));
  // A full disk may not take the shorter file: then the line is appended to the longer one.
  if (static_cast<std::size_t>(status.st_size) > kMaxHolesBytes && Shorten(folder)) {
    file = OpenForLines(path);
    if (!file.valid() || fstat(file.get(), &status) != 0) return Failure(path + ": " + std::strerror(errno));
  }
  ReserveSpace(file);
  // A part of a line that an earlier crash has left becomes a line of its own.
  char last = '\n';
  if (status.st_size > 0 && pread(file.get(), &last, 1, status.st_size - 1) != 1)
    return Failure(path + ": " + std::strerror(errno));
  return AppendText(file, (last == '\n' ? "" : "\n") + FormatHole(hole), status.st_size, path);
}

}  // namespace

std::string FormatHole(const LogHole& hole) {
  return JsonLine({{"file", hole.file},
                   {"logs", hole.logs},
                   {"name", hole.name},
                   {"host", hole.host},
                   {"start_utime", hole.start_utime},
                   {"file_number", hole.file_number},
                   {"first_event", hole.first_event},
                   {"last_utime", hole.last_utime},
                   {"bytes", hole.bytes},
                   {"cause", hole.cause},
                   {"utime", hole.utime}}) +
         '\n';
}

std::optional<LogHole> ParseHole(std::string_view line) {
  const Json json = ParseOutsideJson(line);
  if (!json.is_object()) return std::nullopt;
  LogHole hole;
  for (const auto& [key, text] : {std::pair("file", &LogHole::file),
                                  {"name", &LogHole::name},
                                  {"host", &LogHole::host},
                                  {"cause", &LogHole::cause}}) {
    auto value = JsonText(json, key);
    if (!value) return std::nullopt;
    hole.*text = *std::move(value);
  }
  for (const auto& [key, number] : {std::pair("logs", &LogHole::logs),
                                    {"start_utime", &LogHole::start_utime},
                                    {"file_number", &LogHole::file_number},
                                    {"first_event", &LogHole::first_event},
                                    {"last_utime", &LogHole::last_utime},
                                    {"bytes", &LogHole::bytes},
                                    {"utime", &LogHole::utime}}) {
    const std::optional<std::int64_t> value = JsonCount(json, key);
    if (!value) return std::nullopt;
    hole.*number = *value;
  }
  const bool names_file = !hole.file.empty() && hole.file.find('/') == std::string::npos;
  return names_file && hole.logs > 0 ? std::optional(hole) : std::nullopt;
}

LogHole HoleOf(Bytes log) {
  constexpr int kHeadEvents = 3;
  LogHole hole;
  LogReader reader(log);
  for (int i = 0; i < kHeadEvents; ++i) {
    const auto event = reader.Next();
    if (!event) break;
    if (event->channel != kRecorderChannel) continue;
    const Json json = ParseOutsideJson(AsText(event->data));
    if (!json.is_object()) break;
    hole.name = JsonText(json, "name").value_or("");
    hole.host = JsonText(json, "host").value_or("");
    hole.start_utime = JsonCount(json, "start_utime").value_or(0);
    hole.file_number = JsonCount(json, "file_number").value_or(0);
    break;
  }
  return hole;
}

Result<std::vector<LogHole>> ReadHoles(const std::string& folder, const ShippedLogs& shipped) {
  const Result<std::vector<LogHole>> lines = ReadLines(folder);
  if (!lines) return Failure(lines.error());
  std::vector<LogHole> holes = HolesOf(folder, *lines);
  std::erase_if(holes, [&](const LogHole& hole) { return !IsOpen(hole, shipped); });
  if (holes.empty()) return holes;
  if (const int error = SyncFolderOf(HolesPath(folder)); error != 0)
    return Failure(folder + ": " + std::strerror(error));
  return holes;
}

Result<std::set<std::string>> LogsOfHoles(const std::string& folder) {
  const Result<std::vector<LogHole>> lines = ReadLines(folder);
  if (!lines) return Failure(lines.error());
  std::set<std::string> logs;
  for (const LogHole& hole : *lines) logs.insert(hole.file);
  return logs;
}

Result<> AppendHole(const std::string& folder, const LogHole& hole, const std::function<Result<>()>& remove) {
  const Result<Descriptor> lock = LockOutbox(folder);
  if (!lock) return Failure(lock.error());
  if (Result<> appended = AppendLine(folder, hole); !appended || !remove) return appended;
  Result<> removed = remove();
  if (removed) return removed;
  const Result<> withdrawn = Withdraw(folder);
  return Failure(removed.error().text + (withdrawn ? "" : "; " + withdrawn.error().text));
}

Result<> WithdrawHoles(const std::string& folder) {
  const Result<Descriptor> lock = LockOutbox(folder);
  return lock ? Withdraw(folder) : Failure(lock.error());
}

Result<> ReserveHoles(const std::string& folder) {
  const Descriptor file = OpenForLines(HolesPath(folder));
  if (!file.valid()) return Failure(HolesPath(folder) + ": " + std::strerror(errno));
  ReserveSpace(file);
  return {};
}

std::vector<LogHole> JoinHoles(std::vector<LogHole> holes) {
  std::vector<LogHole> joined;
  std::map<std::tuple<std::string, std::string, std::string>, std::size_t> places;
  const std::size_t older = holes.size() / 2;
  for (std::size_t i = 0; i < holes.size(); ++i) {
    LogHole& hole = holes[i];
    if (i < older) {
      const std::tuple recorder(std::string(LogFilePrefix(hole.file)), hole.name, hole.host);
      const auto [place, is_new] = places.try_emplace(recorder, joined.size());
      if (!is_new) {
        Join(joined[place->second], hole);
        continue;
      }
    }
    joined.push_back(std::move(hole));
  }
  return joined;
}

}  // namespace axlecast
