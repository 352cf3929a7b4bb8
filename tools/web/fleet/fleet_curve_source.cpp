#include "tools/web/fleet/fleet_curve_source.h"

#include <algorithm>
#include <array>

namespace axlecast {
namespace {

constexpr std::int64_t kSecondUs = 1'000'000;
constexpr std::int64_t kMinuteUs = 60 * kSecondUs;
constexpr std::int64_t kDayUs = 1440 * kMinuteUs;
constexpr std::int64_t kLongestOfSamples = kMinuteUs;
constexpr std::int64_t kLongestOfReadings = 10 * kMinuteUs;

constexpr std::array<std::int64_t, 18> kSteps = {
    kSecondUs,      2 * kSecondUs,   5 * kSecondUs,   10 * kSecondUs,  20 * kSecondUs, 30 * kSecondUs,
    kMinuteUs,      2 * kMinuteUs,   5 * kMinuteUs,   10 * kMinuteUs,  20 * kMinuteUs, 30 * kMinuteUs,
    60 * kMinuteUs, 120 * kMinuteUs, 240 * kMinuteUs, 720 * kMinuteUs, kDayUs,         4 * kDayUs};

// Statements. @ is a name of a table or column. The limits of rows bound the memory; the chosen interval keeps curves below.

// The streams of the device that can have rows in the time: `seen` of a stream is within it, and streams follow each other.
constexpr const char* kStreams = R"(
WITH device AS MATERIALIZED (
  SELECT d.id FROM axlecast.device d JOIN axlecast.machine m ON m.id = d.machine WHERE m.name = $1 AND d.name = $2),
streams AS MATERIALIZED (
  (SELECT * FROM axlecast.stream WHERE device = (SELECT id FROM device) AND seen < $3 ORDER BY seen DESC LIMIT 1)
  UNION ALL
  (SELECT * FROM axlecast.stream WHERE device = (SELECT id FROM device) AND seen >= $3 AND seen < $4 LIMIT 1000)
  UNION ALL (SELECT * FROM axlecast.stream WHERE device = (SELECT id FROM device) AND seen >= $4 ORDER BY seen LIMIT 1)),
s AS MATERIALIZED (
  SELECT id, seen, CASE WHEN $6::bool THEN 1 WHEN unit_per_count IS NULL THEN 0 ELSE unit END AS unit,
    CASE WHEN $6::bool THEN 1.0 / nullif(counts_per_turn, 0) ELSE coalesce(unit_per_count, 1) END::float8 AS scale
  FROM streams)
)";

// A chunk has 256 samples at most, with at most 10 s between two: it begins at most 43 min before any of them.
constexpr const char* kSamples = R"(
SELECT c.t0, c.n, c.seq0, c.body, s.id AS stream, s.unit, s.scale
FROM s JOIN axlecast.position_chunk c ON c.stream = s.id
WHERE c.t0 >= $3::timestamptz - interval '45 minutes' AND c.t0 < $4 AND c.t1 >= $3 AND $5::float8 = 0
ORDER BY c.t0 LIMIT 2000)";

constexpr const char* kIntervals = R"(,
p AS (
  SELECT stream, date_bin(make_interval(secs => $5::float8), t, timestamptz '2000-01-01') AS begin,
    sum(mean * valid) / nullif(sum(valid), 0) AS mean, min(lo) AS lo, max(hi) AS hi
  FROM axlecast.@ WHERE stream IN (SELECT id FROM s) AND t >= $3 AND t < $4 GROUP BY 1, 2)
SELECT begin + make_interval(secs => $5::float8 / 2) AS t, mean * scale, lo * scale, hi * scale, s.id AS stream, s.unit
FROM p JOIN s ON s.id = p.stream ORDER BY begin, s.seen LIMIT 3000)";

constexpr const char* kMotorReadings = R"(
SELECT t, @ FROM axlecast.motor_health
WHERE machine = (SELECT id FROM axlecast.machine WHERE name = $1) AND device = $2 AND t >= $3 AND t < $4 AND $5::float8 = 0
ORDER BY t LIMIT 30000)";

constexpr const char* kMotorIntervals = R"(
WITH p AS (
  SELECT date_bin(make_interval(secs => $5::float8), t, timestamptz '2000-01-01') AS begin,
    avg(@) AS mean, min(@) AS lo, max(@) AS hi
  FROM axlecast.motor_health
  WHERE machine = (SELECT id FROM axlecast.machine WHERE name = $1) AND device = $2 AND t >= $3 AND t < $4 GROUP BY 1)
SELECT begin + make_interval(secs => $5::float8 / 2) AS t, mean, lo, hi, 0 AS stream, 0 AS unit
FROM p ORDER BY begin LIMIT 3000)";

// Returns `head`, and the rest of the statement with `name` in place of each @.
std::string With(std::string_view head, std::string_view sql, std::string_view name) {
  std::string text(head);
  for (const char character : sql) {
    if (character == '@') {
      text += name;
    } else {
      text += character;
    }
  }
  return text;
}

}  // namespace

std::vector<CurveSource> CurveSourcesOf(const CurveColumn& column, std::int64_t from, std::int64_t to) {
  using Table = CurveSource::Table;
  const std::int64_t span = to - from;
  // An interval that the time cuts at both ends makes one point more.
  const auto fits = [span](std::int64_t step) { return span / step < kMaxCurvePoints; };
  const auto* const found = std::find_if(kSteps.begin(), kSteps.end(), fits);
  const std::int64_t step = found == kSteps.end() ? kSteps.back() : *found;
  if (column.motor) return {{Table::kMotor, span <= kLongestOfReadings ? 0 : step}};
  std::vector<CurveSource> sources;
  if (span <= kLongestOfSamples) sources.push_back({Table::kSamples, 0});
  if (step < kMinuteUs) sources.push_back({Table::kSeconds, step});
  sources.push_back({Table::kMinutes, std::max(step, kMinuteUs)});
  return sources;
}

std::string CurveSql(CurveSource source, const CurveColumn& column) {
  // Names of tables and columns are of fixed lists, never a text of a browser.
  switch (source.table) {
    case CurveSource::Table::kSamples:
      return With(kStreams, kSamples, "");
    case CurveSource::Table::kSeconds:
      return With(kStreams, kIntervals, "position_second");
    case CurveSource::Table::kMinutes:
      return With(kStreams, kIntervals, "position_minute");
    case CurveSource::Table::kMotor:
      return With("", source.step_us > 0 ? kMotorIntervals : kMotorReadings, column.name);
  }
  return "";
}

}  // namespace axlecast
