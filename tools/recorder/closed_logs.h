#pragma once

#include <cstdint>
#include <map>
#include <string>
#include <string_view>
#include <vector>

#include "core/base/result.h"
#include "core/base/time.h"
#include "tools/log/shipped_logs.h"
#include "tools/recorder/log_compression.h"
#include "tools/recorder/log_retention.h"

namespace axlecast {

struct ClosedLogsStatus {
  std::int64_t held_logs = 0;          // exceed quota or keep, and wait for the shipper
  std::int64_t held_bytes = 0;         // of these logs
  std::int64_t deleted_unshipped = 0;  // logs that this process had to delete before they were shipped
};

// The closed logs of one recorder in its folder: deletes expired ones, and compresses the others. Logs that wait for
// `axlecast ship` are deleted, oldest first, only if the disk is nearly full: one at a time, and each is first written to holes.jsonl
// (tools/log/log_holes.h). Used by one thread; the compression has its own.
class ClosedLogs {
 public:
  ClosedLogs(std::string folder, std::string name, const Retention& retention, bool compress);

  // Does what is due. Call it about once a second. `current`: name of the file that is being written; empty: none.
  // `utime`: us, UNIX time of `now`.
  void Tend(const std::string& current, MonoNs now, std::int64_t utime);

  [[nodiscard]] const ClosedLogsStatus& status() const { return status_; }
  // Returns what the last Tend found, for the operator, if it is new; no text if there is nothing new.
  [[nodiscard]] std::string TakeError();

 private:
  // The files of a log.
  struct Forms {
    std::int64_t bytes = 0;
    bool plain = false;
  };

  [[nodiscard]] bool Tidy();
  [[nodiscard]] std::map<std::string, Forms> FindForms() const;
  [[nodiscard]] std::vector<StoredLog> OwnLogs(const std::string& current, std::int64_t utime);
  [[nodiscard]] std::int64_t LastUtime(const std::string& file, const Forms& forms) const;
  [[nodiscard]] ExpiredLogs Expired(const std::string& current, std::int64_t utime);
  void DeleteUnshipped(const StoredLog& log, std::int64_t utime);
  [[nodiscard]] bool IsFree(const std::string& file);
  [[nodiscard]] Result<> Delete(const std::string& file) const;
  void Compress(const std::string& current);
  [[nodiscard]] std::int64_t SpareBytes() const;
  [[nodiscard]] std::string PathOf(const std::string& file) const { return folder_ + '/' + file; }

  const std::string folder_;
  const std::string name_;
  const Retention retention_;
  const bool compress_;
  bool tidy_ = false;
  std::map<std::string, Forms> forms_;               // as of the last Tend
  std::map<std::string, std::int64_t> last_utimes_;  // of the logs that may have expired
  ShippedLogs shipped_;                              // as of the last Tend
  MonoNs next_compression_ = 0;
  std::string last_compressed_;  // the log that was last begun
  LogCompression compression_;
  ClosedLogsStatus status_;
  std::string error_;
  std::string reported_;
};

}  // namespace axlecast
