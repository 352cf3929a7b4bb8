#include "tools/web/fleet/fleet_page_reader.h"

#include <cmath>
#include <limits>
#include <utility>
#include <vector>

#include "core/messages/enum_names.h"
#include "tools/web/fleet/fleet_trip.h"

namespace axlecast {
namespace {

using Kind = FleetRequest::Kind;
using Table = CurveSource::Table;

db::DatabaseSettings ReaderSettings(db::DatabaseSettings settings) {
  settings.writes = false;
  settings.application = "axlecast web";
  settings.connect_limit = FleetPageReader::kConnectLimit;
  settings.statement_limit = FleetPageReader::kStatementLimit;
  return settings;
}

double OrUnknown(std::optional<double> value) { return value.value_or(std::numeric_limits<double>::quiet_NaN()); }

// Rows of streams with another unit than the newest one are left out: one curve has one unit.
constexpr int kUnitColumn = 5;
std::optional<std::int64_t> UnitOf(const db::Rows& rows) {
  return rows.empty() ? std::nullopt : rows.Int(rows.size() - 1, kUnitColumn);
}

db::DatabaseResult<> AddSamples(FleetCurve& curve, const FleetRequest& request, const db::Rows& rows) {
  for (int row = 0; row < rows.size(); ++row) {
    if (rows.Int(row, kUnitColumn) != UnitOf(rows)) continue;
    const std::string body = rows.Binary(row, 3).value_or("");
    const StoredChunk chunk = {.t0 = rows.Timestamp(row, 0).value_or(0),
                               .n = rows.Int(row, 1).value_or(0),
                               .seq0 = rows.Int(row, 2).value_or(0),
                               .body = body,
                               .stream = rows.Int(row, 4).value_or(0),
                               .scale = OrUnknown(rows.Float(row, 6))};
    if (const Result<> added = AppendSamples(curve.points, chunk, request.from, request.to); !added) {
      return tl::unexpected(db::DatabaseError{{"a row of axlecast.position_chunk: " + added.error().text}, {}, {}});
    }
  }
  return {};
}

void AddIntervals(FleetCurve& curve, const db::Rows& rows) {
  for (int row = 0; row < rows.size(); ++row) {
    if (rows.Int(row, kUnitColumn) != UnitOf(rows)) continue;
    // The least counts are the greatest value if the unit per count is negative.
    const double one = OrUnknown(rows.Float(row, 2));
    const double other = OrUnknown(rows.Float(row, 3));
    curve.points.push_back({.utime = rows.Timestamp(row, 0).value_or(0),
                            .value = OrUnknown(rows.Float(row, 1)),
                            .low = std::fmin(one, other),
                            .high = std::fmax(one, other),
                            .stream = rows.Int(row, 4).value_or(0)});
  }
}

void AddReadings(FleetCurve& curve, const db::Rows& rows) {
  for (int row = 0; row < rows.size(); ++row) {
    const double value = OrUnknown(rows.Float(row, 1));
    curve.points.push_back({rows.Timestamp(row, 0).value_or(0), value, value, value, 0});
  }
}

}  // namespace

FleetPageReader::FleetPageReader(db::DatabaseSettings settings, SecretSource& secrets, const Clock& clock)
    : database_(ReaderSettings(std::move(settings)), secrets), clock_(clock) {}

std::string FleetPageReader::Answer(const FleetRequest& request) {
  if (const auto connected = Connect(); !connected) return FleetErrorFrame(request, connected.error().text, true);
  db::DatabaseResult<std::string> frame = Ask(request);
  if (frame) return *std::move(frame);
  // Without a connection the next question connects again; after a time limit that would only wait once more.
  const bool away = !database_.connected();
  if (away) {
    away_ = frame.error();
    tried_ = clock_.Now();
  }
  return FleetErrorFrame(request, frame.error().text, away);
}

db::DatabaseResult<> FleetPageReader::Connect() {
  if (database_.connected()) return {};
  if (away_ && clock_.Now() - tried_ < kPause) return tl::unexpected(*away_);
  db::DatabaseResult<> done = database_.Connect();
  if (done) {
    done = database_.Script(
        "SET ROLE axlecast_reader; SET default_transaction_read_only = on; SET statement_timeout = " +
        std::to_string(kServerLimitMs));
  }
  away_.reset();
  if (done) return {};
  database_.Close();
  away_ = done.error();
  tried_ = clock_.Now();
  return done;
}

db::DatabaseResult<std::string> FleetPageReader::Ask(const FleetRequest& request) {
  if (request.kind == Kind::kCurve) return AskCurve(request);
  const FleetTable& table = TableOf(request.kind);
  const auto rows = request.kind == Kind::kMachines
                        ? AskMachines(table)
                        : database_.Query(std::string(table.sql), TableParameters(request));
  if (!rows) return tl::unexpected(rows.error());
  const std::int64_t utime = clock_.UtcMicroseconds();
  return request.kind == Kind::kTrips ? TripsFrame(request, *rows, table.max_rows, utime)
                                      : TableFrame(request, table, *rows, utime);
}

db::DatabaseResult<db::Rows> FleetPageReader::AskMachines(const FleetTable& table) {
  const MonoNs now = clock_.Now();
  if (machines_ && now - machines_at_ < kMachinesLast) return *machines_;
  auto rows = database_.Query(std::string(table.sql));
  if (!rows) return rows;
  machines_ = *rows;
  machines_at_ = now;
  return rows;
}

db::DatabaseResult<std::string> FleetPageReader::AskCurve(const FleetRequest& request) {
  FleetCurve curve;
  const CurveColumn& column = *FindCurveColumn(request.column);
  for (const CurveSource source : CurveSourcesOf(column, request.from, request.to)) {
    auto read = ReadSource(request, column, source);
    if (!read) return tl::unexpected(read.error());
    curve = *std::move(read);
    if (!curve.points.empty()) break;
  }
  Thin(curve, request.from, request.to);
  return CurveFrame(request, curve);
}

db::DatabaseResult<FleetCurve> FleetPageReader::ReadSource(const FleetRequest& request, const CurveColumn& column,
                                                           CurveSource source) {
  db::Parameters parameters = {db::Parameter::Text(request.machine), db::Parameter::Text(request.device),
                               db::Parameter::Timestamp(request.from), db::Parameter::Timestamp(request.to),
                               db::Parameter::Float(static_cast<double>(source.step_us) / 1e6)};
  const bool is_motor = source.table == Table::kMotor;
  if (!is_motor) parameters.push_back(db::Parameter::Bool(column.name == "turns"));
  const auto rows = database_.Query(CurveSql(source, column), parameters);
  if (!rows) return tl::unexpected(rows.error());
  FleetCurve curve = {.unit = std::string(column.unit), .step_us = source.step_us};
  if (is_motor && source.step_us == 0) {
    AddReadings(curve, *rows);
    return curve;
  }
  if (!is_motor) curve.unit = UnitName(static_cast<std::int8_t>(UnitOf(*rows).value_or(0)));
  if (source.table == Table::kSamples) {
    if (const auto added = AddSamples(curve, request, *rows); !added) return tl::unexpected(added.error());
  } else {
    AddIntervals(curve, *rows);
  }
  return curve;
}

}  // namespace axlecast
