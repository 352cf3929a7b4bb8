#include "tools/fleet/ship/log_folder.h"

#include <dirent.h>
#include <sys/stat.h>

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <memory>
#include <tuple>
#include <utility>

#include "core/base/spelling.h"
#include "core/config/load.h"
#include "platform/os/log_file.h"
#include "platform/os/mapped_file.h"
#include "tools/log/compressed_log.h"
#include "tools/log/log_name.h"

namespace axlecast {
namespace {

constexpr std::string_view kEnding = ".lcm";
constexpr std::size_t kMaxFacts = 64;  // machine files that are kept parsed

bool IsLogName(std::string_view file) { return PlainLogName(file).ends_with(kEnding); }

// The first bytes of the log, which contain its head.
std::vector<std::uint8_t> FirstBytes(Bytes file) {
  std::vector<std::uint8_t> first;
  if (!IsCompressed(file)) {
    const Bytes head = file.first(std::min(file.size(), kHeadBytes));
    first.assign(head.begin(), head.end());
    return first;
  }
  static_cast<void>(Decompress(file, [&first](Bytes piece, std::size_t) {
    first.insert(first.end(), piece.begin(), piece.end());
    return first.size() < kHeadBytes;
  }));
  return first;
}

// Returns true if the recorder has generated the name: NAME_YYYYMMDDTHHMMSSZ.
bool HasGeneratedName(const std::string& file, const std::string& machine, const std::string& log) {
  return LogFileBegin(machine + '-' + log, file).has_value() || LogFileBegin(log, file).has_value();
}

auto Rank(const FolderLog& log) {
  return std::tuple(HasGeneratedName(log.file, log.facts->machine, log.key.name), !log.compressed, log.bytes);
}

// Keeps one log of each identity.
void RemoveCopies(FolderContent& content) {
  std::map<LogKey, FolderLog> best;
  for (FolderLog& log : content.logs) {
    const auto [found, added] = best.emplace(log.key, log);
    if (added) continue;
    FolderLog other = std::move(log);
    if (Rank(found->second) < Rank(other)) std::swap(found->second, other);
    // While the recorder compresses a log, both files exist.
    if (PlainLogName(other.file) == PlainLogName(found->second.file)) continue;
    content.skipped.push_back(
        {other.file, "it is a copy of " + found->second.file + ": remove it from this folder", true});
  }
  content.logs.clear();
  for (auto& [key, log] : best) content.logs.push_back(std::move(log));
}

}  // namespace

Result<FolderContent> LogFolder::Scan(Timestamp now) {
  const std::unique_ptr<DIR, int (*)(DIR*)> folder(opendir(folder_.c_str()), &closedir);
  if (folder == nullptr) {
    return Failure(folder_ + ": " + std::strerror(errno) +
                   "; it is the folder of the recorder's logs: start `axlecast record`, or "
                   "give --folder");
  }
  for (auto& [file, known] : files_) known.seen = false;
  while (const dirent* const entry = readdir(folder.get())) {
    if (IsLogName(entry->d_name)) Look(entry->d_name, now);
  }
  std::erase_if(files_, [](const auto& file) { return !file.second.seen; });
  FolderContent content;
  for (const auto& [file, known] : files_) {
    if (known.facts == nullptr) {
      if (!known.reason.empty()) content.skipped.push_back({file, known.reason, known.foreign});
      continue;
    }
    content.logs.push_back({.file = file,
                            .key = known.key,
                            .facts = known.facts,
                            .bytes = known.bytes,
                            .compressed = file.ends_with(kCompressedEnding)});
  }
  RemoveCopies(content);
  std::map<std::pair<std::string, std::string>, std::int64_t> newest;  // of each recorder
  for (const FolderLog& log : content.logs) {
    std::int64_t& start = newest[{log.key.name, log.key.host}];
    start = std::max(start, log.key.start_utime);
  }
  for (FolderLog& log : content.logs) {
    const bool is_newest = log.key.start_utime == newest[{log.key.name, log.key.host}];
    log.closed = log.compressed || IsClosed(log, files_[log.file], is_newest, now.mono);
  }
  return content;
}

void LogFolder::Look(const std::string& file, Timestamp now) {
  struct stat status {};
  if (stat((folder_ + '/' + file).c_str(), &status) != 0) {
    if (errno == ENOENT) return;
    files_[file] = {.reason = std::strerror(errno), .seen = true};
    return;
  }
  if (!S_ISREG(status.st_mode)) return;
  Known& known = files_[file];
  known.seen = true;
  const bool same = known.inode == status.st_ino && status.st_size >= known.bytes;
  // A file that could not be read may have new rights.
  const bool read = known.facts != nullptr || (known.changed.tv_sec == status.st_ctim.tv_sec &&
                                               known.changed.tv_nsec == status.st_ctim.tv_nsec);
  if (same && read && status.st_size == known.bytes) return;
  if (!same) known = {.inode = status.st_ino, .found = now.mono, .seen = true};
  known.released = false;
  known.changed = status.st_ctim;
  known.bytes = status.st_size;
  // A file that is seen for the first time may have been quiet for long.
  const std::int64_t age_us =
      now.utime - (std::int64_t{status.st_mtim.tv_sec} * 1'000'000 + status.st_mtim.tv_nsec / 1'000);
  known.grown = same ? now.mono : now.mono - std::clamp<std::int64_t>(age_us, 0, 3'600'000'000) * kMicrosecond;
  if (known.facts == nullptr) ReadHead(file, known);
}

void LogFolder::ReadHead(const std::string& file, Known& known) {
  known.reason.clear();
  const MappedFile mapped(folder_ + '/' + file);
  if (!mapped.problem().empty()) {
    known.reason = mapped.problem();
    return;
  }
  Result<LogHead> head = ReadLogHead(FirstBytes(mapped.bytes()));
  if (!head) {
    // The head of a new log may not be written yet.
    if (!mapped.bytes().empty()) known.reason = head.error().text;
    return;
  }
  known.key = std::move(head->key);
  Result<std::shared_ptr<const LogFacts>> facts = FactsOf(head->machine);
  if (!facts) {
    known.reason = facts.error().text;
  } else if (std::ranges::find(names_, (*facts)->machine) == names_.end()) {
    known.foreign = true;
    known.reason = "it is a log of the machine " + Quoted((*facts)->machine) + ", not of " + Listed(names_);
  } else if (std::ranges::none_of((*facts)->logs,
                                  [&](const LogConfig& log) { return log.name == known.key.name; })) {
    known.foreign = true;
    known.reason = "it is not one of the logs of the machine's file, but a recording by hand";
  } else {
    known.facts = *std::move(facts);
  }
}

Result<std::shared_ptr<const LogFacts>> LogFolder::FactsOf(const std::string& machine) {
  if (const auto found = facts_.find(machine); found != facts_.end()) return found->second;
  ConfigErrors errors("the machine's file in its head");
  const auto config = ParseConfig(machine, errors);
  if (!config) return Failure("the machine's file in its head cannot be used: " + errors.Text());
  auto facts = std::make_shared<const LogFacts>(LogFactsOf(*config));
  if (facts_.size() >= kMaxFacts) facts_.clear();
  facts_[machine] = facts;
  return std::shared_ptr<const LogFacts>(std::move(facts));
}

bool LogFolder::IsClosed(const FolderLog& log, Known& known, bool is_newest, MonoNs now) const {
  const MonoNs since = is_newest ? known.grown : std::min(known.grown, known.found);
  if (now - since < kQuiet) return false;
  if (!known.released) known.released = !LogFile::IsBeingWritten(folder_ + '/' + log.file);
  return known.released;
}

}  // namespace axlecast
