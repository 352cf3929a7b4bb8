#include "tools/fleet/read/position_query.h"

#include <algorithm>
#include <array>
#include <axlecast/position_t.hpp>
#include <limits>
#include <utility>

#include "core/base/text.h"
#include "core/messages/enum_names.h"
#include "tools/fleet/position_chunk.h"

namespace axlecast {
namespace {

using db::Parameter;

// us, of a chunk.
constexpr std::int64_t kLongestChunk = static_cast<std::int64_t>(kMaxChunkSamples) * ChunkBuilder::kLongestPause;

Parameter Limit(std::int64_t rows) { return rows == INT64_MAX ? Parameter::Null() : Parameter::Int(rows); }
std::int64_t FirstTime(const QueryTimes& times, std::int64_t before = 0) {
  return times.from && *times.from > INT64_MIN + before ? *times.from - before : INT64_MIN;
}
Parameter From(const QueryTimes& times, std::int64_t before = 0) {
  return Parameter::Timestamp(FirstTime(times, before));
}
Parameter Until(const QueryTimes& times) { return Parameter::Timestamp(times.until.value_or(INT64_MAX)); }

// A table of positions.
struct PositionTable {
  const char* name;
  const char* time;          // its column
  std::int64_t longest = 0;  // us, of a row
};
constexpr PositionTable kChunkTable = {"axlecast.position_chunk", "t0", kLongestChunk};
constexpr PositionTable kSecondTable = {"axlecast.position_second", "t"};
constexpr PositionTable kMinuteTable = {"axlecast.position_minute", "t"};

PositionChunkRow ChunkOf(const db::Rows& row) {
  const auto number = [&](int column) { return row.Int(0, column).value_or(0); };
  PositionChunkRow chunk;
  chunk.t0 = row.Timestamp(0, 0).value_or(0);
  chunk.t1 = row.Timestamp(0, 1).value_or(0);
  chunk.seq0 = number(2);
  chunk.first = number(3);
  chunk.last = number(4);
  chunk.summary.n = number(5);
  chunk.summary.valid = number(6);
  chunk.summary.missed = number(7);
  chunk.summary.flags_or = static_cast<std::int32_t>(number(8));
  chunk.summary.flags_and = static_cast<std::int32_t>(number(9));
  const std::string body = row.Binary(0, 10).value_or("");
  chunk.body.assign(body.begin(), body.end());
  return chunk;
}

// Counts in the unit of the stream; NaN if that is unknown.
double ValueOf(double counts, const StreamKey& key) {
  return key.unit_per_count ? counts * *key.unit_per_count : std::numeric_limits<double>::quiet_NaN();
}

std::string BootText(std::int64_t boot_id) { return Text("%016llx", static_cast<unsigned long long>(boot_id)); }

// The columns of a body that only detail `full` stores.
struct FullColumns {
  explicit FullColumns(Bytes body) {
    const auto columns = SplitBody(body);
    if (!columns) return;  // DecodePositionChunk states why
    for (const ColumnView& column : *columns) {
      if (column.id < present.size()) present[column.id] = true;
    }
  }
  [[nodiscard]] bool Has(ColumnId id) const { return present[static_cast<std::size_t>(id)]; }

  std::array<bool, 64> present{};
};

void WriteFull(const PositionSample& sample, const FullColumns& columns, TableWriter& table) {
  const auto number = [&](ColumnId id, std::int64_t value) { columns.Has(id) ? table.Int(value) : table.Null(); };
  number(ColumnId::kMonoOffset, sample.mono_ns);
  number(ColumnId::kUncertainty, sample.time_uncertainty_ns);
  number(ColumnId::kRawCounts, sample.raw_counts);
  number(ColumnId::kRawTurns, sample.raw_turns);
  columns.Has(ColumnId::kRawCounts) ? table.Float(sample.angle_rad) : table.Null();
  columns.Has(ColumnId::kRawCounts) ? table.Float(sample.value) : table.Null();
  columns.Has(ColumnId::kSpeed) && (sample.flags & position_t::FLAG_SPEED_VALID) != 0
      ? table.Float(sample.speed_rad_s)
      : table.Null();
  number(ColumnId::kDeviceStatus, sample.device_status);
  number(ColumnId::kTick, sample.tick);
  number(ColumnId::kReceived, sample.received);
}

Result<std::vector<FleetStream>> StreamsOf(FleetReader& reader, const FleetDevice& device,
                                           const PositionTable& source, const QueryTimes& times) {
  return reader.Streams(device, source.name, source.time, FirstTime(times, source.longest),
                        times.until.value_or(INT64_MAX));
}

// Executes `use` for each stream of each device until the rows reach the limit.
Result<QueryResult> ForEachStream(
    FleetReader& reader, const std::vector<FleetDevice>& devices, const PositionTable& source,
    const PositionQuery& query, TableWriter& table,
    const std::function<Result<>(const FleetStream&, std::int64_t left, QueryResult&)>& use) {
  QueryResult result;
  const std::int64_t before = table.rows();
  const std::int64_t most = query.limit > 0 ? query.limit : INT64_MAX;
  for (const FleetDevice& device : devices) {
    const auto streams = StreamsOf(reader, device, source, query.times);
    if (!streams) return Failure(streams.error());
    for (const FleetStream& stream : *streams) {
      const std::int64_t left = most == INT64_MAX ? most : most - (table.rows() - before);
      if (left == 0 || !table.good()) break;
      if (Result<> used = use(stream, left, result); !used) return Failure(used.error());
    }
  }
  result.rows = table.rows() - before;
  return result;
}

void WriteRollup(const db::Rows& row, const StreamKey& key, TableWriter& table) {
  const std::int64_t t = row.Timestamp(0, 0).value_or(0);
  const std::optional<std::int64_t> lo = row.Int(0, 4);
  const std::optional<std::int64_t> hi = row.Int(0, 5);
  const std::optional<double> mean = row.Float(0, 6);
  const auto number = [&](const std::optional<std::int64_t>& value) { value ? table.Int(*value) : table.Null(); };
  const auto value = [&](std::optional<double> counts) {
    counts ? table.Float(ValueOf(*counts, key)) : table.Null();
  };
  const auto real = [](const std::optional<std::int64_t>& counts) {
    return counts ? std::optional<double>(static_cast<double>(*counts)) : std::nullopt;
  };
  const bool reversed = key.unit_per_count.value_or(1) < 0;  // the greatest count is the least value
  table.Int(t).Utc(t).Text(key.device);
  number(row.Int(0, 1));
  number(row.Int(0, 2));
  number(row.Int(0, 3));
  number(lo);
  number(hi);
  mean ? table.Float(*mean) : table.Null();
  value(real(reversed ? hi : lo));
  value(real(reversed ? lo : hi));
  value(mean);
  table.Text(UnitName(key.unit));
  number(row.Int(0, 7));
  number(row.Int(0, 8));
  table.Text(BootText(key.boot_id)).Int(key.datum_epoch).EndRow();
}

}  // namespace

Result<std::vector<FleetStream>> ChunkStreams(FleetReader& reader, const FleetDevice& device,
                                              const QueryTimes& times) {
  return StreamsOf(reader, device, kChunkTable, times);
}

Result<> ForEachChunk(FleetReader& reader, const FleetStream& stream, const QueryTimes& times,
                      std::optional<std::int64_t> log, const std::function<bool(const PositionChunkRow&)>& visit) {
  return reader.ForEach(
      "SELECT t0, t1, seq0, first, last, n, valid, missed, flags_or, flags_and, body FROM axlecast.position_chunk"
      " WHERE stream = $1 AND t0 >= $2 AND t0 < $3 AND t1 >= $4 AND ($5::int4 IS NULL OR log = $5::int4) ORDER BY "
      "t0, seq0",
      {Parameter::Int(stream.id), From(times, kLongestChunk), Until(times), From(times),
       log ? Parameter::Int(*log) : Parameter::Null()},
      [&](const db::Rows& row) { return visit(ChunkOf(row)); });
}

std::vector<std::string> PositionColumns(bool full) {
  std::vector<std::string> columns = {"utime", "utc",   "device",     "seq",    "counts",  "value",
                                      "unit",  "flags", "flag_names", "missed", "boot_id", "datum_epoch"};
  if (full) {
    for (const char* name : {"mono_ns", "time_uncertainty_ns", "raw_counts", "raw_turns", "angle_rad",
                             "published_value", "speed_rad_s", "device_status", "tick", "received_utime"}) {
      columns.emplace_back(name);
    }
  }
  return columns;
}

std::vector<std::string> RollupColumns() {
  return {"utime",    "utc",      "device",     "n",    "valid",    "missed",    "lo",      "hi",         "mean",
          "lo_value", "hi_value", "mean_value", "unit", "flags_or", "flags_and", "boot_id", "datum_epoch"};
}

Result<> WriteChunk(const PositionChunkRow& chunk, const StreamKey& key, const QueryTimes& times, bool full,
                    std::int64_t limit, TableWriter& table) {
  const auto samples = DecodePositionChunk(chunk, key);
  if (!samples) return Failure(samples.error());
  const FullColumns columns(chunk.body);
  const std::string boot = BootText(key.boot_id);
  std::optional<std::int32_t> named;  // the flags that `names` are of: they rarely change
  std::string names;
  for (const PositionSample& sample : *samples) {
    if (!times.Contains(sample.utime)) continue;
    if (limit-- == 0) break;
    if (named != sample.flags) {
      named = sample.flags;
      names = FlagNames(sample.flags);
      std::replace(names.begin(), names.end(), ',', ' ');
    }
    const bool valid = (sample.flags & position_t::FLAG_VALID) != 0;
    table.Int(sample.utime).Utc(sample.utime).Text(key.device).Int(sample.seq).Int(sample.counts);
    valid ? table.Float(ValueOf(static_cast<double>(sample.counts), key)) : table.Null();
    table.Text(UnitName(key.unit)).Int(sample.flags).Text(names).Int(sample.missed).Text(boot).Int(key.datum_epoch);
    if (full) WriteFull(sample, columns, table);
    if (!table.EndRow()) break;
  }
  return {};
}

Result<QueryResult> WritePositions(FleetReader& reader, const std::vector<FleetDevice>& devices,
                                   const PositionQuery& query, TableWriter& table) {
  return ForEachStream(
      reader, devices, kChunkTable, query, table,
      [&](const FleetStream& stream, std::int64_t left, QueryResult& result) {
        const std::int64_t end = left == INT64_MAX ? left : table.rows() + left;
        return ForEachChunk(reader, stream, query.times, std::nullopt, [&](const PositionChunkRow& chunk) {
          const Result<> written = WriteChunk(chunk, stream.key, query.times, query.full,
                                              end == INT64_MAX ? end : end - table.rows(), table);
          if (!written && ++result.damaged == 1) {
            result.first_damage =
                stream.key.device + ", " + UtcMicrosecondText(chunk.t0) + ": " + written.error().text;
          }
          return table.good() && table.rows() < end;
        });
      });
}

Result<QueryResult> WriteRollups(FleetReader& reader, const std::vector<FleetDevice>& devices, RollupSpan span,
                                 const PositionQuery& query, TableWriter& table) {
  const PositionTable& source = span == RollupSpan::kSeconds ? kSecondTable : kMinuteTable;
  const std::string sql = "SELECT t, n, valid, missed, lo, hi, mean, flags_or, flags_and FROM " +
                          std::string(source.name) +
                          " WHERE stream = $1 AND t >= $2 AND t < $3 ORDER BY t LIMIT $4::int8";
  return ForEachStream(
      reader, devices, source, query, table, [&](const FleetStream& stream, std::int64_t left, QueryResult&) {
        return reader.ForEach(sql, {Parameter::Int(stream.id), From(query.times), Until(query.times), Limit(left)},
                              [&](const db::Rows& row) {
                                WriteRollup(row, stream.key, table);
                                return table.good();
                              });
      });
}

}  // namespace axlecast
