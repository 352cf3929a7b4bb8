#include "tools/recorder/closed_logs.h"

#include <algorithm>
#include <filesystem>
#include <system_error>
#include <utility>

#include "platform/os/log_file.h"
#include "platform/os/mapped_file.h"
#include "tools/log/compressed_log.h"
#include "tools/log/log_holes.h"
#include "tools/log/log_merge.h"
#include "tools/log/log_name.h"

namespace axlecast {
namespace {

constexpr MonoNs kRetryCompression = 60 * kSecond;
constexpr std::int64_t kSpare =
    64 << 20;  // bytes that the compression leaves free for the log that is being written

std::string Compressed(const std::string& path) { return path + std::string(kCompressedEnding); }

std::filesystem::space_info SpaceOf(const std::string& folder) {
  std::error_code error;  // then nothing is known, and the disk counts as empty
  return std::filesystem::space(folder, error);
}

// Returns the beginning of the log, at most about `size` bytes, as it was before its compression.
std::vector<std::uint8_t> BeginningOf(const std::string& path, std::size_t size) {
  std::vector<std::uint8_t> begin;
  const auto take = [&](Bytes piece, std::size_t) {
    begin.insert(begin.end(), piece.begin(),
                 piece.begin() + static_cast<std::ptrdiff_t>(std::min(piece.size(), size)));
    return begin.size() < size;
  };
  const MappedFile plain(path);
  if (plain.problem().empty()) {
    static_cast<void>(take(plain.bytes(), 0));
  } else {
    const MappedFile compressed(Compressed(path));
    static_cast<void>(Decompress(compressed.bytes(), take));
  }
  return begin;
}

}  // namespace

ClosedLogs::ClosedLogs(std::string folder, std::string name, const Retention& retention, bool compress)
    : folder_(std::move(folder)), name_(std::move(name)), retention_(retention), compress_(compress) {}

void ClosedLogs::Tend(const std::string& current, MonoNs now, std::int64_t utime) {
  const bool limited = retention_.quota_bytes > 0 || retention_.keep_us > 0;
  if (!limited && !compress_) return;
  error_ = compression_.TakeError();
  if (!error_.empty()) next_compression_ = now + kRetryCompression;
  const bool may_compress = compress_ && !compression_.busy() && now >= next_compression_;
  if (!tidy_) tidy_ = Tidy();
  forms_ = FindForms();
  const ExpiredLogs found = Expired(current, utime);
  for (const StoredLog& log : found.expired) {
    if (!IsFree(log.file)) continue;
    if (const Result<> deleted = Delete(log.file); !deleted) error_ = deleted.error().text;
  }
  status_.held_logs = static_cast<std::int64_t>(found.held.size());
  status_.held_bytes = 0;
  for (const StoredLog& log : found.held) status_.held_bytes += log.bytes;
  const auto space = SpaceOf(folder_);
  const bool full = IsNearlyFull(retention_, static_cast<std::int64_t>(space.capacity),
                                 static_cast<std::int64_t>(space.available));
  if (!found.held.empty() && full) {
    DeleteUnshipped(found.held.front(), utime);
  } else if (may_compress) {
    Compress(current);
  }
}

std::string ClosedLogs::TakeError() {
  const bool is_new = error_ != reported_;
  reported_ = error_;
  return is_new ? error_ : "";
}

// Removes what a killed recorder has left. Returns false if that must be tried again.
bool ClosedLogs::Tidy() {
  std::error_code error;
  for (const auto& entry : std::filesystem::directory_iterator(folder_, error)) {
    std::string log;
    const bool unfinished = IsUnfinishedCompression(entry.path().filename().string(), log);
    if (unfinished && LogFileBegin(name_, log)) std::filesystem::remove(entry.path(), error);
  }
  if (!retention_.needs_shipping) return true;
  Result<> holes = WithdrawHoles(folder_);
  if (holes) holes = ReserveHoles(folder_);
  if (!holes) error_ = holes.error().text;
  return holes.has_value();
}

std::map<std::string, ClosedLogs::Forms> ClosedLogs::FindForms() const {
  std::map<std::string, Forms> found;
  std::error_code error;
  for (const auto& entry : std::filesystem::directory_iterator(folder_, error)) {
    const std::string file = entry.path().filename().string();
    if (!LogFileBegin(name_, file) || !entry.is_regular_file(error)) continue;
    const std::string plain(PlainLogName(file));
    Forms& forms = found[plain];
    forms.bytes += static_cast<std::int64_t>(entry.file_size(error));
    forms.plain = forms.plain || file == plain;
  }
  return found;
}

// Returns the logs of this recorder in the folder. Only logs that may have expired are opened.
std::vector<StoredLog> ClosedLogs::OwnLogs(const std::string& current, std::int64_t utime) {
  std::vector<StoredLog> logs;
  std::map<std::string, std::int64_t> last_utimes;
  for (const auto& [file, forms] : forms_) {
    std::int64_t last = 0;
    if (retention_.keep_us > 0 && *LogFileBegin(name_, file) < utime - retention_.keep_us && file != current) {
      const auto known = last_utimes_.find(file);
      last = known != last_utimes_.end() ? known->second : LastUtime(file, forms);
      last_utimes.emplace(file, last);
    }
    logs.push_back({file, forms.bytes, last});
  }
  last_utimes_ = std::move(last_utimes);
  return logs;
}

// Returns the time of the last event of a log (us, UNIX time), or 0 if it is unknown: no event can be read, or another program has
// compressed the log.
std::int64_t ClosedLogs::LastUtime(const std::string& file, const Forms& forms) const {
  const MappedFile log(forms.plain ? PathOf(file) : Compressed(PathOf(file)));
  if (!log.problem().empty()) return 0;
  if (forms.plain) return SpanOf({log.bytes()}).last;
  const auto summary = FindSummary(log.bytes());
  return summary ? summary->last_utime : 0;
}

ExpiredLogs ClosedLogs::Expired(const std::string& current, std::int64_t utime) {
  std::vector<StoredLog> logs = OwnLogs(current, utime);
  ExpiredLogs found = FindExpired(logs, name_, current, retention_, utime);
  if (found.held.empty()) return found;
  Result<ShippedLogs> shipped = ReadShippedLogs(folder_);
  if (!shipped) error_ = shipped.error().text;
  shipped_ = shipped ? *std::move(shipped) : ShippedLogs();
  for (StoredLog& log : logs) log.shipped = shipped_.Of(log.file).complete;
  return FindExpired(std::move(logs), name_, current, retention_, utime);
}

void ClosedLogs::DeleteUnshipped(const StoredLog& log, std::int64_t utime) {
  if (!tidy_) return;
  // What a compression has written so far may be all that is missing.
  if (compression_.busy()) return compression_.Cancel();
  if (!IsFree(log.file)) return;
  constexpr std::size_t kHead = 64U << 10;
  LogHole hole = HoleOf(BeginningOf(PathOf(log.file), kHead));
  hole.file = log.file;
  hole.first_event = shipped_.Of(log.file).upto;
  hole.last_utime = log.last_utime > 0 ? log.last_utime : LastUtime(log.file, forms_[log.file]);
  hole.bytes = log.bytes;
  hole.cause = "disk nearly full";
  hole.utime = utime;
  if (const Result<> deleted = AppendHole(folder_, hole, [&] { return Delete(log.file); }); !deleted) {
    error_ = log.file + " is not deleted, although the disk is nearly full: " + deleted.error().text;
    return;
  }
  ++status_.deleted_unshipped;
  error_ = log.file + ": deleted before it was shipped, because the disk is nearly full; see " +
           PathOf("holes.jsonl") + ", and check `axlecast ship`";
}

// Returns true if neither a recorder nor the compression uses the log.
bool ClosedLogs::IsFree(const std::string& file) {
  return !LogFile::IsBeingWritten(PathOf(file)) && compression_.Release(PathOf(file));
}

Result<> ClosedLogs::Delete(const std::string& file) const {
  for (const std::string& path : {Compressed(PathOf(file)), PathOf(file)}) {
    std::error_code error;
    std::filesystem::remove(path, error);
    if (error) return Failure(file + ": cannot be deleted: " + error.message());
  }
  return {};
}

// Compresses the next log. One that could not be compressed is tried again after the others.
void ClosedLogs::Compress(const std::string& current) {
  const auto may_begin = [&](const auto& log) {
    return log.second.plain && log.first != current && !LogFile::IsBeingWritten(PathOf(log.first));
  };
  auto next = std::find_if(forms_.upper_bound(last_compressed_), forms_.end(), may_begin);
  if (next == forms_.end()) next = std::find_if(forms_.begin(), forms_.end(), may_begin);
  if (next == forms_.end()) return;
  last_compressed_ = next->first;
  compression_.Start(PathOf(next->first), SpareBytes());
}

std::int64_t ClosedLogs::SpareBytes() const {
  const auto part =
      static_cast<std::int64_t>(static_cast<double>(SpaceOf(folder_).capacity) * retention_.reserve_percent / 100);
  return retention_.needs_shipping ? std::max({kSpare, retention_.reserve_bytes, part}) : kSpare;
}

}  // namespace axlecast
