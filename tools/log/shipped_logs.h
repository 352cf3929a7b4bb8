#pragma once

#include <cstdint>
#include <functional>
#include <map>
#include <nlohmann/json_fwd.hpp>
#include <optional>
#include <string>
#include <string_view>

#include "core/base/result.h"
#include "platform/os/descriptor.h"

namespace axlecast {

// The folder of a recorder's logs is the outbox of `axlecast ship`. <folder>/shipped.json states what the database has. The
// shipper writes the file after a commit of the database, and the recorder reads it before it deletes logs. The ledger in the
// database decides; the file may be behind it, never before it. tools/log/log_holes.h: the logs that had to be deleted before.

struct ShippedLog {
  std::int64_t upto = 0;  // events below this number are in the database
  bool complete = false;  // the log is closed, and all of its events are in the database or need not be
  std::int64_t hole = 0;  // LogHole::logs of the hole that the database has for this log; 0: it has none
  bool operator==(const ShippedLog&) const = default;
};

struct ShippedLogs {
  std::map<std::string, ShippedLog, std::less<>> logs;  // by PlainLogName (tools/log/log_name.h)
  std::int64_t utime = 0;                               // us, UNIX time of the last change

  // Returns the entry of a log, also by the name of its compressed file. Without an entry, nothing of the log is shipped.
  [[nodiscard]] ShippedLog Of(std::string_view file) const;
};

// One JSON object: {"logs":{"press3-positions_20261121T070005Z.lcm":{"upto":1200,"complete":true}},"utime":1790000000000000}.
// "hole" is present if it is not 0. Other keys are ignored.
[[nodiscard]] std::string FormatShippedLogs(const ShippedLogs& shipped);
// Fails for any other text, and for a number out of its range: then nothing counts as shipped.
[[nodiscard]] Result<ShippedLogs> ParseShippedLogs(std::string_view text);

// Returns the content of <folder>/shipped.json; nothing is shipped if the file is missing. Fails if the file is damaged or
// cannot be read.
[[nodiscard]] Result<ShippedLogs> ReadShippedLogs(const std::string& folder);

// Sets the entries of these logs in <folder>/shipped.json, and its utime; other entries stay, because several machines may share
// a folder. Entries whose log is neither in the folder nor in holes.jsonl are removed. A damaged file is replaced. When the
// function returns, the file is on disk. Fails without a change if another process holds the lock: try again later.
[[nodiscard]] Result<> MarkShipped(const std::string& folder, const ShippedLogs& changed);

// Returns the number of this key, from 0 to INT64_MAX; nothing if the object has no such number.
[[nodiscard]] std::optional<std::int64_t> JsonCount(const nlohmann::ordered_json& object, const char* key);

// Locks shipped.json and holes.jsonl of the folder against other writers, for some ms, until the descriptor is closed. Fails at once
// if another thread or process holds the lock. The folder itself is locked, so that processes of different users need no file.
[[nodiscard]] Result<Descriptor> LockOutbox(const std::string& folder);

}  // namespace axlecast
