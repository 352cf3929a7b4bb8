#include "tools/recorder/log_writer.h"

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <filesystem>
#include <limits>
#include <numeric>
#include <system_error>
#include <tuple>
#include <utility>

#include "platform/os/mapped_file.h"
#include "tools/log/log_event.h"
#include "tools/log/log_merge.h"
#include "tools/log/log_name.h"

namespace axlecast {
namespace {

constexpr std::size_t kFlushBytes = 1 << 20;
constexpr MonoNs kRetry = kSecond;
constexpr MonoNs kTending = kSecond;
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

}  // namespace

LogWriter::LogWriter(LogWriterSettings settings, const Clock& clock)
    : settings_(std::move(settings)),
      clock_(clock),
      closed_logs_(settings_.folder, settings_.name, settings_.retention, settings_.compress) {}

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
  if (now >= next_tending_) TendClosedLogs();
}

MonoNs LogWriter::next_poll() const {
  const MonoNs sync = unsynced_since_ == kNever ? kNever : unsynced_since_ + settings_.sync_interval;
  return std::min({sync, retry_at_, next_tending_});
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
  next_tending_ = 0;
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
    std::error_code ignored;  // then the name counts as free
    const bool taken = !given && std::filesystem::exists(status_.file + std::string(kCompressedEnding), ignored);
    error = taken ? EEXIST : file_.Create(status_.file);
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

void LogWriter::TendClosedLogs() {
  next_tending_ = clock_.Now() + kTending;
  status_.free_bytes = FreeBytes();
  if (!settings_.file.empty()) return;
  closed_logs_.Tend(CurrentName(), clock_.Now(), clock_.UtcMicroseconds());
  status_.closed = closed_logs_.status();
  std::string error = closed_logs_.TakeError();
  if (error.empty()) return;
  status_.last_error = std::move(error);
  status_.last_error_utime = clock_.UtcMicroseconds();
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
