#include "tools/recorder/log_compression.h"

#include <fcntl.h>
#include <poll.h>
#include <sys/file.h>
#include <sys/stat.h>

#include <algorithm>
#include <array>
#include <cctype>
#include <cerrno>
#include <cstring>
#include <filesystem>
#include <string_view>
#include <system_error>
#include <utility>

#include "platform/os/descriptor.h"
#include "platform/os/mapped_file.h"
#include "platform/os/new_file.h"
#include "platform/os/process.h"
#include "platform/os/system_clock.h"
#include "tools/log/compressed_log.h"
#include "tools/log/log_event.h"
#include "tools/log/log_merge.h"
#include "tools/log/log_name.h"

namespace axlecast {
namespace {

constexpr std::size_t kRandomEnding = 7;  // ".XXXXXX" of NewFile

Result<> CheckSpace(const std::string& path, std::int64_t spare_bytes) {
  std::error_code error;
  const auto space = std::filesystem::space(std::filesystem::path(path).parent_path(), error);
  if (error || static_cast<std::int64_t>(space.available) >= spare_bytes) return {};
  return Failure(path + ": not compressed, because the disk is nearly full");
}

// Returns true if an earlier process has compressed this log, and was killed before it removed the log.
bool IsCompressedAlready(const std::string& target, std::size_t bytes) {
  std::error_code error;
  if (!std::filesystem::exists(target, error)) return false;
  const MappedFile file(target);
  const auto summary = FindSummary(file.bytes());
  return summary && summary->bytes == bytes;
}

// Holds the lock that a recorder holds, so that no recorder continues the log while it is replaced.
Result<Descriptor> LockUnchanged(const MappedFile& log) {
  Descriptor lock(open(log.path().c_str(), O_RDONLY | O_CLOEXEC));
  struct stat status {};
  if (!lock.valid() || fstat(lock.get(), &status) != 0) return Failure(log.path() + ": " + std::strerror(errno));
  if (flock(lock.get(), LOCK_EX | LOCK_NB) != 0 && errno == EWOULDBLOCK)
    return Failure(log.path() + ": not compressed, because a recorder writes it");
  std::string loss = log.Loss();
  if (loss.empty() && static_cast<std::size_t>(status.st_size) != log.bytes().size())
    loss = log.path() + ": has grown while it was compressed";
  return loss.empty() ? Result<Descriptor>(std::move(lock)) : Failure(loss);
}

Result<> Remove(const std::string& path) {
  std::error_code error;
  std::filesystem::remove(path, error);
  return error ? Failure(path + ": is compressed, but cannot be deleted: " + error.message()) : Result<>();
}

Result<> AppendPiece(NewFile& out, LogCompressor& compressor, Bytes piece) {
  const Result<Bytes> frame = compressor.Compress(piece);
  if (!frame) return Failure(frame.error());
  Result<> appended = out.Append(AsText(*frame));
  out.Flush();
  return appended;
}

}  // namespace

Result<> CompressLog(const std::string& path, std::int64_t spare_bytes,
                     const std::function<bool(CompressionStep)>& go_on) {
  const MappedFile log(path);
  if (!log.problem().empty()) return Failure(log.problem());
  const std::string target = path + std::string(kCompressedEnding);
  if (IsCompressedAlready(target, log.bytes().size()) && go_on(CompressionStep::kReplace)) {
    const Result<Descriptor> lock = LockUnchanged(log);
    return lock ? Remove(path) : Failure(lock.error());
  }
  NewFile out(target, log.access());
  LogCompressor compressor;
  for (Bytes rest = log.bytes(); !rest.empty();) {
    if (!go_on(CompressionStep::kPiece)) return {};
    if (Result<> space = CheckSpace(path, spare_bytes); !space) return space;
    const std::size_t size = std::min(rest.size(), kFrameBytes);
    if (Result<> appended = AppendPiece(out, compressor, rest.first(size)); !appended) return appended;
    rest = rest.subspan(size);
  }
  const LogSpan span = SpanOf({log.bytes()});
  const CompressedLogSummary summary{log.bytes().size(), span.first, span.last};
  if (Result<> appended = out.Append(AsText(EncodeSummary(summary))); !appended) return appended;
  out.Flush();
  if (!go_on(CompressionStep::kReplace)) return {};
  const Result<Descriptor> lock = LockUnchanged(log);
  if (!lock) return Failure(lock.error());
  if (Result<> committed = out.Commit(true); !committed) return committed;
  return Remove(path);
}

bool IsUnfinishedCompression(std::string_view file, std::string& log) {
  if (file.size() <= kRandomEnding) return false;
  const std::string_view target = file.substr(0, file.size() - kRandomEnding);
  const std::string_view ending = file.substr(target.size());
  if (!target.ends_with(kCompressedEnding) || ending[0] != '.') return false;
  if (!std::all_of(ending.begin() + 1, ending.end(), [](unsigned char c) { return std::isalnum(c) != 0; }))
    return false;
  log = PlainLogName(target);
  return true;
}

LogCompression::~LogCompression() {
  Cancel();
  if (thread_.joinable()) thread_.join();
}

void LogCompression::Start(const std::string& path, std::int64_t spare_bytes) {
  if (thread_.joinable()) thread_.join();  // it has ended
  path_ = path;
  static_cast<void>(cancel_.Take());
  replacing_ = false;
  busy_ = true;
  thread_ = std::thread([this, path, spare_bytes] { Run(path, spare_bytes); });
}

void LogCompression::Run(const std::string& path, std::int64_t spare_bytes) {
  LowerPriority();
  const SystemClock clock;
  std::array<pollfd, 1> cancel = {{{cancel_.FileDescriptor(), POLLIN, 0}}};
  MonoNs begun = clock.Now();
  const Result<> done = CompressLog(path, spare_bytes, [&](CompressionStep step) {
    const MonoNs now = clock.Now();
    if (step == CompressionStep::kPiece) static_cast<void>(PollUntil(cancel, now + (now - begun), clock));
    begun = clock.Now();
    return GoOn(step);
  });
  const std::scoped_lock lock(mutex_);
  error_ = IsCancelled() ? "" : ErrorText(done);  // its files may have been deleted meanwhile
  busy_ = false;
}

bool LogCompression::GoOn(CompressionStep step) {
  const std::scoped_lock lock(mutex_);  // Release and this call exclude each other
  const bool cancelled = IsCancelled();
  replacing_ = !cancelled && step == CompressionStep::kReplace;
  return !cancelled;
}

bool LogCompression::IsCancelled() const {
  std::array<pollfd, 1> cancel = {{{cancel_.FileDescriptor(), POLLIN, 0}}};
  return poll(cancel.data(), cancel.size(), 0) > 0;
}

bool LogCompression::Release(const std::string& path) {
  const std::scoped_lock lock(mutex_);
  if (!busy_ || path_ != path) return true;
  if (!replacing_) cancel_.Set();
  return !replacing_;
}

void LogCompression::Cancel() { cancel_.Set(); }

std::string LogCompression::TakeError() {
  const std::scoped_lock lock(mutex_);
  return std::exchange(error_, "");
}

}  // namespace axlecast
