#pragma once

#include <cstdint>
#include <deque>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "core/base/time.h"
#include "platform/os/log_file.h"
#include "tools/recorder/closed_logs.h"
#include "tools/recorder/log_composer.h"

namespace axlecast {

struct LogWriterSettings {
  std::string folder;                         // of logs with generated names
  std::string name;                           // of these logs; used if `file` is empty
  std::string file;                           // the first log; the following ones are <file>_001, <file>_002, ...
  MonoNs sync_interval = 100 * kMillisecond;  // maximum time until written data is on the disk
  Retention retention;                        // of logs with generated names
  bool compress = false;                      // closed logs with generated names
};

enum class DiskState : std::uint8_t { kGood, kFull, kFailed };

struct LogWriterStatus {
  DiskState state = DiskState::kGood;
  std::string file;  // that is being written
  std::int64_t file_bytes = 0;
  std::int64_t free_bytes = -1;  // on its disk; -1: unknown
  std::string last_error;        // what happened, and how to fix it
  std::int64_t last_error_utime = 0;
  bool damaged = false;  // written data may be missing on the disk
  ClosedLogsStatus closed;
};

// Writes logs to files. If a write fails, the data is kept in memory and written again after one second. A file always ends with a
// complete record. Used by one thread, which waits for the disk.
class LogWriter final : public LogSink {
 public:
  LogWriter(LogWriterSettings settings, const Clock& clock);

  // Continues the file as the first log. The file is truncated to `size`.
  void Append(std::int64_t size) { append_ = size; }

  void Begin(std::int64_t utime) override;
  void Write(Bytes record) override;
  void End() override;

  // Writes, syncs, retries, and deletes and compresses closed logs, when each is due.
  void Poll();
  [[nodiscard]] MonoNs next_poll() const;
  // Returns true if the last write failed: records are kept in memory.
  [[nodiscard]] bool blocked() const { return retry_at_ != kNever; }
  // Writes at once what is in memory, also if the last write failed less than a second ago.
  void Retry() { Flush(); }
  // Tries a last time. Returns the number of messages that could not be written.
  [[nodiscard]] std::int64_t Finish();

  [[nodiscard]] const LogWriterStatus& status() const { return status_; }

 private:
  // The part of a log that is not written yet.
  struct Pending {
    std::int64_t utime = 0;
    std::vector<std::uint8_t> bytes;
    bool ended = false;
  };

  void Flush();
  [[nodiscard]] bool Drain(Pending& log);
  [[nodiscard]] bool Open(const Pending& log);
  [[nodiscard]] int CreateFile(const Pending& log);
  [[nodiscard]] std::string PathOf(const Pending& log, int copy) const;
  void OnWriteFailed(int error);
  void OnSynced(int error);
  void TendClosedLogs();
  [[nodiscard]] std::int64_t FreeBytes() const;
  [[nodiscard]] std::string CurrentName() const;  // without the folder; empty: no file is open

  LogWriterSettings settings_;
  const Clock& clock_;
  LogFile file_;
  std::deque<Pending> pending_;
  std::optional<std::int64_t> append_;
  bool first_ = true;
  std::string newest_name_;  // without the number of the copy
  int newest_copy_ = 0;
  MonoNs unsynced_since_ = kNever;
  MonoNs retry_at_ = kNever;
  MonoNs next_tending_ = 0;
  ClosedLogs closed_logs_;
  LogWriterStatus status_;
};

}  // namespace axlecast
