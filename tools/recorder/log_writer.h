#pragma once

#include <cstdint>
#include <deque>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "core/base/time.h"
#include "platform/os/log_file.h"
#include "tools/recorder/log_composer.h"
#include "tools/recorder/retention.h"

namespace axlecast {

struct LogWriterSettings {
  std::string folder;                         // of logs that the recorder names itself (retention.h)
  std::string name;                           // of these; may then be empty: `file`
  std::string file;                           // the first log; what it is split into is called <file>_001 and so on
  MonoNs sync_interval = 100 * kMillisecond;  // what was written is on the disk so long after
  Retention retention;                        // of logs that it names itself
};

enum class DiskState : std::uint8_t { kGood, kFull, kFailed };

struct LogWriterStatus {
  DiskState state = DiskState::kGood;
  std::string file;  // being written
  std::int64_t file_bytes = 0;
  std::int64_t free_bytes = -1;  // on its disk; -1 unknown
  std::string last_error;        // with what mends it
  std::int64_t last_error_utime = 0;
  bool damaged = false;  // the disk took something and did not keep it
};

// Writes logs to files. What the disk does not take is kept and tried again each second: a file always ends with a whole
// record. One thread; it waits for the disk.
class LogWriter final : public LogSink {
 public:
  LogWriter(LogWriterSettings settings, const Clock& clock);

  // The first log goes on in the file, which is kept up to `size`.
  void Append(std::int64_t size) { append_ = size; }

  void Begin(std::int64_t utime) override;
  void Write(Bytes record) override;
  void End() override;

  // Writes what is there, makes it last when its time has come, tries again, deletes what has expired.
  void Poll();
  [[nodiscard]] MonoNs next_poll() const;
  // The disk takes nothing now: what is given is kept in memory.
  [[nodiscard]] bool blocked() const { return retry_at_ != kNever; }
  // A last try. The number of messages that could not be written.
  [[nodiscard]] std::int64_t Finish();

  [[nodiscard]] const LogWriterStatus& status() const { return status_; }

 private:
  // A log, from its first byte that is not written yet.
  struct Pending {
    std::int64_t utime = 0;
    std::vector<std::uint8_t> bytes;
    bool ended = false;
  };

  void Flush();
  [[nodiscard]] bool Drain(Pending& log);
  [[nodiscard]] bool Open(const Pending& log);
  [[nodiscard]] int OpenFile(const Pending& log);
  [[nodiscard]] int CreateFile(const Pending& log);
  void CloseFile();
  [[nodiscard]] std::string PathOf(const Pending& log, int copy) const;
  void Sync();
  void Fail(int error);
  void Note(int error);
  void KeepHouse();
  [[nodiscard]] std::vector<StoredLog> OwnLogs(std::int64_t utime);
  [[nodiscard]] std::int64_t FreeBytes() const;
  [[nodiscard]] std::string CurrentName() const;  // without the folder; empty: none is open

  LogWriterSettings settings_;
  const Clock& clock_;
  LogFile file_;
  std::deque<Pending> pending_;
  std::optional<std::int64_t> append_;
  bool first_ = true;
  std::string newest_name_;  // without the copy's number
  int newest_copy_ = 0;
  MonoNs unsynced_since_ = kNever;
  MonoNs retry_at_ = kNever;
  MonoNs next_housekeeping_ = 0;
  std::map<std::string, std::int64_t> last_utimes_;  // of logs that are old enough to ask
  LogWriterStatus status_;
};

}  // namespace axlecast
