#include "tools/recorder/log_writer.h"

#include <algorithm>
#include <cctype>
#include <cerrno>
#include <cstring>
#include <filesystem>
#include <limits>
#include <numeric>
#include <system_error>
#include <tuple>
#include <utility>

#include "core/base/text.h"
#include "core/base/utc_text.h"
#include "platform/os/mapped_file.h"
#include "tools/log/log_event.h"
#include "tools/log/log_merge.h"

namespace axlecast {
namespace {

constexpr std::string_view kEnding = ".lcm";
constexpr std::size_t kStamp = 16;  // 20261121T070005Z

bool AreDigits(std::string_view text) {
  return !text.empty() &&
         std::all_of(text.begin(), text.end(), [](unsigned char c) { return std::isdigit(c) != 0; });
}

constexpr const char* kStampFormat = "%Y%m%dT%H%M%SZ";

// Returns the suffix of a further file of the same name: "_007".
std::string CopySuffix(int copy) { return copy > 0 ? Text("_%03d", copy) : ""; }

struct DatedLog {
  std::int64_t begin;
  StoredLog log;
};

// Returns the logs with generated names, oldest first.
std::vector<DatedLog> OwnLogs(std::vector<StoredLog> logs, std::string_view name) {
  std::vector<DatedLog> own;
  for (StoredLog& log : logs) {
    if (const auto begin = LogFileBegin(name, log.file)) own.push_back({*begin, std::move(log)});
  }
  std::sort(own.begin(), own.end(), [](const DatedLog& one, const DatedLog& other) {
    const std::size_t one_size = one.log.file.size();  // _1000 follows _999
    const std::size_t other_size = other.log.file.size();
    return std::tie(one.begin, one_size, one.log.file) < std::tie(other.begin, other_size, other.log.file);
  });
  return own;
}

// Returns the latest possible time of the last event (us, UNIX time).
std::int64_t EndOf(const std::vector<DatedLog>& logs, std::size_t i) {
  if (logs[i].log.last_utime > 0) return logs[i].log.last_utime;
  return i + 1 < logs.size() ? logs[i + 1].begin : std::numeric_limits<std::int64_t>::max();
}

constexpr std::size_t kFlushBytes = 1 << 20;
constexpr MonoNs kRetry = kSecond;
constexpr MonoNs kDeletion = kSecond;
constexpr int kMaxCopies = 9'999;  // files of one name

bool IsFull(int error) { return error == ENOSPC || error == EDQUOT; }

std::string FixFor(int error) {
  switch (error) {
    case ENOSPC:
      return "; free some space: recording continues by itself";
    case EDQUOT:
      return "; raise the disk quota or free some space: recording continues by itself";
    case EEXIST:
      return "; choose another name, or continue it with --append";
    case EBUSY:
      return "; another recorder writes it: stop that recorder, or choose another name";
    case EACCES:
    case EPERM:
    case EROFS:
      return "; choose a folder that this user may write to";
    case ENOENT:
      return "; create the folder first";
    default:
      return "";
  }
}

// Returns the size of the complete records within the first `limit` bytes. Adds the number of messages among them to `messages`.
std::size_t WholeRecords(Bytes records, std::size_t limit, std::int64_t& messages) {
  std::size_t whole = 0;
  while (const auto event = ParseEvent(records.subspan(whole))) {
    const std::size_t size = EventSize(*event);
    if (whole + size > limit) break;
    whole += size;
    if (!IsLogChannel(event->channel)) ++messages;
  }
  return whole;
}

// Returns the time of the last event of a log (us, UNIX time), or 0 if no event can be read.
std::int64_t LastUtime(const std::filesystem::path& path) {
  const MappedFile file(path.string());
  return file.problem().empty() ? SpanOf({file.bytes()}).last : 0;
}

}  // namespace

std::string LogFileName(std::string_view name, std::int64_t utime, int copy) {
  return std::string(name) + '_' + FormatUtc(utime, kStampFormat) + CopySuffix(copy) + std::string(kEnding);
}

std::optional<std::int64_t> LogFileBegin(std::string_view name, std::string_view file) {
  if (!file.starts_with(name) || !file.ends_with(kEnding)) return std::nullopt;
  file.remove_prefix(name.size());
  if (file.size() < 1 + kStamp + kEnding.size() || file[0] != '_') return std::nullopt;
  file.remove_prefix(1);
  file.remove_suffix(kEnding.size());
  const std::string_view copy = file.substr(kStamp);
  if (!copy.empty() && (copy.size() < 4 || copy[0] != '_' || !AreDigits(copy.substr(1)))) return std::nullopt;
  return ParseUtcAs(std::string(file.substr(0, kStamp)), kStampFormat);
}

std::vector<std::string> ExpiredLogs(std::vector<StoredLog> logs, std::string_view name, std::string_view current,
                                     const Retention& retention, std::int64_t utime) {
  const std::vector<DatedLog> own = OwnLogs(std::move(logs), name);
  std::int64_t bytes = std::accumulate(own.begin(), own.end(), std::int64_t{0},
                                       [](std::int64_t sum, const DatedLog& each) { return sum + each.log.bytes; });
  std::vector<std::string> expired;
  for (std::size_t i = 0; i < own.size(); ++i) {
    if (own[i].log.file == current) continue;
    const bool old = retention.keep_us > 0 && EndOf(own, i) < utime - retention.keep_us;
    const bool over = retention.quota_bytes > 0 && bytes > retention.quota_bytes && i + 1 < own.size();
    if (!old && !over) continue;
    bytes -= own[i].log.bytes;
    expired.push_back(own[i].log.file);
  }
  return expired;
}

LogWriter::LogWriter(LogWriterSettings settings, const Clock& clock)
    : settings_(std::move(settings)), clock_(clock) {}

void LogWriter::Begin(std::int64_t utime) { pending_.push_back({utime, {}, false}); }

void LogWriter::Write(Bytes record) {
  Pending& log = pending_.back();
  log.bytes.insert(log.bytes.end(), record.begin(), record.end());
  if (log.bytes.size() >= kFlushBytes && !blocked()) Flush();
}

void LogWriter::End() { pending_.back().ended = true; }

void LogWriter::Poll() {
  const MonoNs now = clock_.Now();
  if (!blocked() || now >= retry_at_) Flush();
  if (unsynced_since_ != kNever && now - unsynced_since_ >= settings_.sync_interval) OnSynced(file_.Sync());
  if (now >= next_deletion_) DeleteExpired();
}

MonoNs LogWriter::next_poll() const {
  const MonoNs sync = unsynced_since_ == kNever ? kNever : unsynced_since_ + settings_.sync_interval;
  return std::min({sync, retry_at_, next_deletion_});
}

void LogWriter::Flush() {
  while (!pending_.empty()) {
    Pending& log = pending_.front();
    if (!file_.is_open() && !Open(log)) return;
    if (!Drain(log)) return;
    retry_at_ = kNever;
    if (!status_.damaged) status_.state = DiskState::kGood;
    if (!log.ended) return;
    OnSynced(file_.Close());
    pending_.pop_front();
  }
}

bool LogWriter::Drain(Pending& log) {
  if (log.bytes.empty()) return true;
  const std::int64_t before = file_.size();
  Bytes rest = log.bytes;
  const int error = file_.Write(rest);
  if (file_.size() > before && unsynced_since_ == kNever) unsynced_since_ = clock_.Now();
  std::size_t written = log.bytes.size() - rest.size();
  if (error != 0) {
    // Truncate to the last complete record, so that readers find a valid file.
    std::int64_t messages = 0;
    const std::size_t whole = WholeRecords(log.bytes, written, messages);
    if (file_.CutTo(before + static_cast<std::int64_t>(whole)) == 0) written = whole;
    OnWriteFailed(error);
  }
  log.bytes.erase(log.bytes.begin(), log.bytes.begin() + static_cast<std::ptrdiff_t>(written));
  status_.file_bytes = file_.size();
  return error == 0;
}

bool LogWriter::Open(const Pending& log) {
  int error = 0;
  if (append_ && first_) {
    status_.file = settings_.file;
    error = file_.Continue(settings_.file, *append_);
  } else {
    error = CreateFile(log);
  }
  if (error != 0) {
    file_ = LogFile();  // one that could not be cut to its end is not written
    OnWriteFailed(error);
    return false;
  }
  status_.file_bytes = file_.size();
  next_deletion_ = 0;
  first_ = false;
  return true;
}

int LogWriter::CreateFile(const Pending& log) {
  const bool given = !settings_.file.empty();
  // Numbers only increase, even if the quota has deleted earlier files of this second.
  const std::string plain = PathOf(log, 0);
  int copy = plain == newest_name_ ? newest_copy_ + 1 : 0;
  int error = EEXIST;
  for (; copy <= kMaxCopies; ++copy) {
    status_.file = PathOf(log, copy);
    error = file_.Create(status_.file);
    if (error != EEXIST) break;
    if (given && first_) break;
  }
  if (error != 0) return error;
  newest_name_ = plain;
  newest_copy_ = copy;
  return 0;
}

std::string LogWriter::PathOf(const Pending& log, int copy) const {
  if (settings_.file.empty()) {
    return (std::filesystem::path(settings_.folder) / LogFileName(settings_.name, log.utime, copy)).string();
  }
  std::filesystem::path path(settings_.file);
  return (path.parent_path() / (path.stem().string() + CopySuffix(copy) + path.extension().string())).string();
}

void LogWriter::OnWriteFailed(int error) {
  retry_at_ = clock_.Now() + kRetry;
  status_.state = IsFull(error) ? DiskState::kFull : DiskState::kFailed;
  status_.last_error = status_.file + ": " + std::strerror(error) + FixFor(error);
  status_.last_error_utime = clock_.UtcMicroseconds();
}

// After an error, the written data may be lost. A later success does not change that.
void LogWriter::OnSynced(int error) {
  unsynced_since_ = kNever;
  if (error == 0) return;
  status_.damaged = true;
  status_.state = DiskState::kFailed;
  status_.last_error = status_.file + ": written data may not be on the disk: " + std::strerror(error);
  status_.last_error_utime = clock_.UtcMicroseconds();
}

// Returns the logs of this recorder in the folder. Only logs that may have expired are opened.
std::vector<StoredLog> LogWriter::OwnLogs(std::int64_t utime) {
  std::vector<StoredLog> logs;
  std::map<std::string, std::int64_t> last_utimes;
  const std::int64_t keep_us = settings_.retention.keep_us;
  std::error_code error;
  for (const auto& entry : std::filesystem::directory_iterator(settings_.folder, error)) {
    std::string file = entry.path().filename().string();
    const auto begin = LogFileBegin(settings_.name, file);
    if (!begin || !entry.is_regular_file(error)) continue;
    std::int64_t last = 0;
    if (keep_us > 0 && *begin < utime - keep_us && file != CurrentName()) {
      const auto known = last_utimes_.find(file);
      last = known != last_utimes_.end() ? known->second : LastUtime(entry.path());
      last_utimes.emplace(file, last);
    }
    logs.push_back({std::move(file), static_cast<std::int64_t>(entry.file_size(error)), last});
  }
  last_utimes_ = std::move(last_utimes);
  return logs;
}

std::string LogWriter::CurrentName() const {
  return file_.is_open() ? std::filesystem::path(status_.file).filename().string() : "";
}

std::int64_t LogWriter::FreeBytes() const {
  if (file_.is_open()) return file_.FreeBytes();
  if (settings_.folder.empty()) return -1;
  std::error_code error;
  const auto space = std::filesystem::space(settings_.folder, error);
  return error ? -1 : static_cast<std::int64_t>(space.available);
}

void LogWriter::DeleteExpired() {
  next_deletion_ = clock_.Now() + kDeletion;
  status_.free_bytes = FreeBytes();
  const Retention& retention = settings_.retention;
  if (!settings_.file.empty() || (retention.quota_bytes == 0 && retention.keep_us == 0)) return;
  const std::int64_t utime = clock_.UtcMicroseconds();
  for (const std::string& file : ExpiredLogs(OwnLogs(utime), settings_.name, CurrentName(), retention, utime)) {
    const std::filesystem::path path = std::filesystem::path(settings_.folder) / file;
    if (LogFile::IsBeingWritten(path.string())) continue;  // by another recorder with this name
    std::error_code error;
    if (std::filesystem::remove(path, error); !error) continue;
    status_.last_error = file + ": cannot be deleted: " + error.message();
    status_.last_error_utime = clock_.UtcMicroseconds();
  }
}

std::int64_t LogWriter::Finish() {
  Flush();
  if (file_.is_open()) OnSynced(file_.Close());
  std::int64_t messages = 0;
  for (const Pending& log : pending_) {
    static_cast<void>(WholeRecords(log.bytes, log.bytes.size(), messages));
  }
  pending_.clear();
  return messages;
}

}  // namespace axlecast
