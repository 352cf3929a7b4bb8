#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <optional>
#include <set>
#include <string>
#include <string_view>
#include <vector>

#include "core/base/inline_bytes.h"
#include "core/base/result.h"
#include "tools/log/shipped_logs.h"

namespace axlecast {

// Logs that the recorder had to delete before they were completely in the database: <folder>/holes.jsonl, one JSON object per line.
//
// The recorder appends the line, syncs it, and then deletes the log. A line is a hole only if the log is gone:
// - After a crash between the two steps, the log is still there: ReadHoles ignores the line, and WithdrawHoles removes it when the
//   recorder starts. The log may still be shipped.
// - ReadHoles syncs the folder before it returns a hole. A log whose absence was reported cannot come back after a power failure.
// - A torn or damaged line is ignored. The log of a torn line was not deleted.
struct LogHole {
  std::string file;       // PlainLogName of the log; if logs were joined: of the oldest
  std::int64_t logs = 1;  // number of logs; more than 1: the file had become too large, and holes were joined
  std::string name;       // from the head of the log: name of the recorder; empty: the head could not be read
  std::string host;       // from the head
  std::int64_t start_utime = 0;  // from the head (us, UNIX time)
  std::int64_t file_number = 0;  // from the head
  std::int64_t first_event = 0;  // events below this number are in the database
  std::int64_t last_utime = 0;   // of the last event (us, UNIX time); 0: unknown
  std::int64_t bytes = 0;        // size of the files
  std::string cause;             // "disk nearly full"
  std::int64_t utime = 0;        // us, UNIX time of the deletion
  bool operator==(const LogHole&) const = default;
};

// Returns one line of JSON, with the newline.
[[nodiscard]] std::string FormatHole(const LogHole& hole);
// `line`: without the newline. Returns nothing for any other text.
[[nodiscard]] std::optional<LogHole> ParseHole(std::string_view line);

// Returns a hole with the name, host, start and file number that the head of the log contains. `log`: the log or its beginning.
[[nodiscard]] LogHole HoleOf(Bytes log);

// Returns the holes that are not in the database yet, oldest first: the log is gone, and `shipped` (ReadShippedLogs) neither has
// it as complete nor has this hole. If several lines name a log, the last one counts. Fails if the file cannot be read.
[[nodiscard]] Result<std::vector<LogHole>> ReadHoles(const std::string& folder, const ShippedLogs& shipped);

// Adds a hole durably, and then calls `remove`, which deletes the log. The folder stays locked meanwhile, so that another recorder does
// not withdraw the line. If `remove` fails, the line is withdrawn, and its error is returned. If the file exceeds kMaxHolesBytes, lines that are of no use any more are
// removed first; if that is not enough, the older half of the holes is joined, per recorder. Fails if the disk does not take the
// line, or if another process holds the lock; then `remove` is not called.
inline constexpr std::size_t kMaxHolesBytes = 256U << 10;
[[nodiscard]] Result<> AppendHole(const std::string& folder, const LogHole& hole,
                                  const std::function<Result<>()>& remove = {});

// Removes the lines of logs that are in the folder. Call it when a recorder starts.
[[nodiscard]] Result<> WithdrawHoles(const std::string& folder);

// Creates the file if it is missing, and reserves space for its lines: a full disk must take the line before a log is deleted.
[[nodiscard]] Result<> ReserveHoles(const std::string& folder);

// Returns the logs that the lines name, whether they are gone or not.
[[nodiscard]] Result<std::set<std::string>> LogsOfHoles(const std::string& folder);

// Returns the older half of the holes joined: one hole per recorder (name, host and the part of `file` before its time), in the
// place of its oldest. `holes`: oldest first.
[[nodiscard]] std::vector<LogHole> JoinHoles(std::vector<LogHole> holes);

}  // namespace axlecast
