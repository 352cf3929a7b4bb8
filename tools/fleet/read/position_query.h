#pragma once

#include <cstdint>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "core/base/result.h"
#include "tools/fleet/read/fleet_reader.h"
#include "tools/fleet/read/table_writer.h"
#include "tools/fleet/rows.h"

namespace axlecast {

// Times of the rows to read, in us, UNIX time: from <= t < until. Nothing: no limit.
struct QueryTimes {
  std::optional<std::int64_t> from;
  std::optional<std::int64_t> until;

  [[nodiscard]] bool Contains(std::int64_t utime) const {
    return (!from || utime >= *from) && (!until || utime < *until);
  }
};

// Returns the streams of the device that have samples within the times.
[[nodiscard]] Result<std::vector<FleetStream>> ChunkStreams(FleetReader& reader, const FleetDevice& device,
                                                            const QueryTimes& times);

// Calls `visit` with each chunk of the stream that has samples within the times, by t0, until it returns false. The first and the last
// chunk can have samples outside. `log`: only the chunks of this log.
[[nodiscard]] Result<> ForEachChunk(FleetReader& reader, const FleetStream& stream, const QueryTimes& times,
                                    std::optional<std::int64_t> log,
                                    const std::function<bool(const PositionChunkRow&)>& visit);

struct PositionQuery {
  QueryTimes times;
  bool full = false;       // with the columns of detail `full`
  std::int64_t limit = 0;  // maximum number of rows; 0: none
};

// The rows of an answer, and what is missing in them.
struct QueryResult {
  std::int64_t rows = 0;
  std::int64_t damaged = 0;  // chunks that cannot be decoded; their samples are missing
  std::string first_damage;  // why
};

// The columns of positions, and of seconds and minutes.
[[nodiscard]] std::vector<std::string> PositionColumns(bool full);
[[nodiscard]] std::vector<std::string> RollupColumns();

// Writes the samples of a chunk that are within the times, at most `limit` rows (INT64_MAX: all). Fails on a damaged chunk.
[[nodiscard]] Result<> WriteChunk(const PositionChunkRow& chunk, const StreamKey& key, const QueryTimes& times,
                                  bool full, std::int64_t limit, TableWriter& table);

// Write the samples, or the seconds or minutes, of the devices: device by device, in the order of time. Do not end the table.
[[nodiscard]] Result<QueryResult> WritePositions(FleetReader& reader, const std::vector<FleetDevice>& devices,
                                                 const PositionQuery& query, TableWriter& table);
enum class RollupSpan : std::uint8_t { kSeconds, kMinutes };
[[nodiscard]] Result<QueryResult> WriteRollups(FleetReader& reader, const std::vector<FleetDevice>& devices,
                                               RollupSpan span, const PositionQuery& query, TableWriter& table);

}  // namespace axlecast
