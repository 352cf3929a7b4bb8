#pragma once

#include <axlecast/alarm_t.hpp>
#include <cstdint>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <vector>

#include "core/alarm/alarm_table.h"
#include "core/base/time.h"
#include "core/messages/origin.h"
#include "tools/fleet/ship/log_folder.h"

namespace axlecast {

// Why a part of the work failed when it was tried last; empty after a success.
struct ShipProblems {
  std::string database = {};   // no connection, or it accepts nothing
  std::string folder = {};     // the logs cannot be read
  std::string marks = {};      // shipped.json cannot be written
  std::string retention = {};  // what is too old cannot be deleted

  // Returns all of them in one line.
  [[nodiscard]] std::string Text() const;
};

// The state of a shipper.
struct ShipStatus {
  bool connected = false;
  bool fenced = false;
  std::string host = {};  // of the database
  ShipProblems problems = {};
  MonoNs away_since = 0;  // since when there is no connection
  std::int64_t batches = 0;
  std::int64_t bytes = 0;    // of the logs
  std::int64_t samples = 0;  // positions
  std::int64_t events = 0;   // rows of the other tables
  std::int64_t odd = 0;      // messages with times that the database does not accept
  std::int64_t holes = 0;    // rows
  std::int64_t lag_bytes = 0;
  std::int64_t lag_logs = 0;  // logs that are not complete in the database
  std::int64_t lag_us =
      0;  // age of the newest message in the database of the log that is furthest behind and being written
  std::int64_t oldest_us = 0;  // age of the oldest message that is not in the database
  std::vector<SkippedLog> skipped = {};
};

// Returns an object with all numbers. `state`: "running" or "ended".
[[nodiscard]] nlohmann::ordered_json ShipStatusJson(const std::string& machine, const char* state,
                                                    std::int64_t utime, const ShipStatus& status);
// Returns a line for the log: "connected to db1, 3 s behind, 1.2 MB in 2 logs wait; 12345 samples shipped".
[[nodiscard]] std::string ShipStatusLine(const ShipStatus& status);

// The channel of its alarms: ALARM/ship/<machine>.
[[nodiscard]] std::string ShipAlarmName(const std::string& machine);

// Makes the messages on ALARM/ship/<machine>.
class ShipAlarms {
 public:
  static constexpr MonoNs kAway = 10 * kSecond;               // a restart of the database raises no alarm
  static constexpr MonoNs kUnreadable = 10 * kSecond;         // the head of a new log may not be complete
  static constexpr std::int64_t kLate = 10 * 60 * 1'000'000;  // us

  ShipAlarms(const std::string& machine, const Origin& origin) : alarms_(ShipAlarmName(machine), origin) {}

  // `utime`: us, UNIX time of `now`. The message is valid until the next call.
  [[nodiscard]] const alarm_t& Make(const ShipStatus& status, MonoNs now, std::int64_t utime);

 private:
  ProgramAlarms alarms_;
  std::int64_t holes_before_ = 0;
  std::optional<MonoNs> unreadable_since_;  // a log, or the folder
};

}  // namespace axlecast
