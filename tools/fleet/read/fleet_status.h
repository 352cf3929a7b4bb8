#pragma once

#include <cstdint>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "core/base/result.h"
#include "tools/fleet/read/fleet_reader.h"

namespace axlecast {

// How up to date the database is with one machine. Times are us, UNIX time; nothing: unknown.
struct MachineStatus {
  std::string name;
  std::string shipper;                     // host and process; empty: none so far
  std::optional<std::int64_t> last_utime;  // newest message in the database
  std::optional<std::int64_t> last_batch;  // the server's time
  std::optional<std::int64_t> lag_bytes;   // of logs that are not in the database yet
  std::optional<std::int64_t> lag_logs;
  std::int64_t holes = 0;
  std::int64_t new_holes = 0;              // noticed since StatusLimits::holes_us
  std::int64_t odd = 0;                    // rows of the table odd
  std::optional<double> samples_per_s;     // positions in the last whole minute before last_utime
  std::optional<std::int64_t> free_bytes;  // of the machine's disk, by its recorder
};

struct TableSize {
  std::string name;
  std::int64_t bytes = 0;  // with indexes
};

struct ServerStatus {
  std::string host;
  std::string identity;  // of the database: equal if two connections reach the same one
  std::string error;     // why the server cannot be read; empty: the rest is valid
  std::int64_t now = 0;  // the server's time, us, UNIX time
  std::int64_t schema_version = 0;
  std::int64_t database_bytes = 0;
  std::vector<TableSize> tables;  // greatest first
  std::vector<MachineStatus> machines;
};

struct StatusLimits {
  std::int64_t late_us = 60'000'000;       // a machine whose newest message is older is late
  std::int64_t holes_us = 86'400'000'000;  // a hole that was noticed in this time is new
};

// Returns true if the machine needs attention: it is late, or has a new hole.
[[nodiscard]] bool IsLate(const MachineStatus& machine, std::int64_t now, const StatusLimits& limits);
[[nodiscard]] bool NeedsAttention(const MachineStatus& machine, std::int64_t now, const StatusLimits& limits);

// Reads the status of the server that the reader is connected to: of one machine, or of all if `machine` is empty.
[[nodiscard]] Result<ServerStatus> ReadServerStatus(FleetReader& reader, const std::string& machine,
                                                    const StatusLimits& limits);

// Format the status of several servers: of the database, and of its shards.
[[nodiscard]] std::string FleetStatusText(const std::vector<ServerStatus>& servers, const StatusLimits& limits);
[[nodiscard]] nlohmann::ordered_json FleetStatusJson(const std::vector<ServerStatus>& servers,
                                                     const StatusLimits& limits);

}  // namespace axlecast
