#pragma once

#include <cstdint>
#include <map>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <vector>

#include "core/base/result.h"
#include "core/config/machine_config.h"
#include "tools/fleet/detail.h"
#include "tools/fleet/read/fleet_reader.h"
#include "tools/fleet/read/log_digest.h"
#include "tools/fleet/ship/log_head.h"

namespace axlecast {

// Compares a log with what the database has of it.

// The positions that the database has of a log, by device.
struct DatabasePositions {
  std::int64_t samples = 0;  // by the heads of the chunks
  PositionDigest digest;     // of the decoded chunks
  std::int64_t damaged = 0;  // chunks that cannot be decoded
};
using DatabaseDevices = std::map<std::string, DatabasePositions>;

// Returns the ledger's row of the log; nothing if it has none.
[[nodiscard]] Result<std::optional<FleetLog>> FindLog(FleetReader& reader, const FleetMachine& machine,
                                                      const LogKey& key);
// Returns the messages of the log in the table odd, by their numbers.
[[nodiscard]] Result<std::vector<OddEvent>> ReadOddEvents(FleetReader& reader, const FleetLog& log);
// Returns the holes of the log, by the numbers of their events.
[[nodiscard]] Result<std::vector<LogGap>> ReadGaps(FleetReader& reader, const FleetLog& log);
// Return the samples of the log: their number only, or decoded.
[[nodiscard]] Result<DatabaseDevices> ReadSampleCounts(FleetReader& reader, const FleetMachine& machine,
                                                       const FleetLog& log);
[[nodiscard]] Result<DatabaseDevices> ReadDigests(FleetReader& reader, const FleetMachine& machine,
                                                  const FleetLog& log);

// Returns what this log contributes of each device's positions, by the machine's file in its head: kNone if another log contributes
// them. `log`: its name within `recorder.logs`.
[[nodiscard]] std::map<std::string, Detail> ShippedDetails(const MachineConfig& machine, const std::string& log,
                                                           const std::map<std::string, DevicePositions>& devices);

struct LogComparisonInput {
  const LogDigest& log;
  const FleetLog& ledger;
  const DatabaseDevices& database;
  const std::map<std::string, Detail>& details;
  bool content = true;    // the digests of `database` are filled
  bool complete = false;  // events that are not in the database yet are a difference
};

struct LogComparison {
  struct Device {
    std::string name;
    std::int64_t in_log = 0;  // samples
    std::int64_t in_database = 0;
    Detail detail = Detail::kSamples;  // below: not every sample is shipped, so that they are not compared
  };

  std::int64_t events = 0;     // that were compared
  std::int64_t remaining = 0;  // of the log, that are not in the database yet
  std::int64_t gaps = 0;       // stretches of the log that are holes in the database
  std::int64_t missing = 0;    // their messages
  bool content = true;
  std::vector<Device> devices;
  std::vector<std::string> differences;  // one line each; empty: equal
};

[[nodiscard]] LogComparison Compare(const LogComparisonInput& input);

[[nodiscard]] std::string ComparisonText(const std::string& file, const LogComparison& comparison);
[[nodiscard]] nlohmann::ordered_json ComparisonJson(const std::string& file, const LogComparison& comparison);

}  // namespace axlecast
