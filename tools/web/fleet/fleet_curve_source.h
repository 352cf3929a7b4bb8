#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "tools/web/fleet_request.h"

namespace axlecast {

// Maximum points of one curve, unless streams end within its time.
inline constexpr std::int64_t kMaxCurvePoints = 2000;

// Where the points of a curve come from.
struct CurveSource {
  enum class Table : std::uint8_t {
    kSamples,  // position_chunk: every stored sample
    kSeconds,  // position_second
    kMinutes,  // position_minute
    kMotor,    // motor_health: every stored reading
  };
  Table table = Table::kSamples;
  std::int64_t step_us = 0;  // length of an interval that becomes one point; 0: none

  bool operator==(const CurveSource&) const = default;
};

// Returns the sources for a time, the one with the most detail first. The next one is for the case that a source has no
// rows, because its retention is over or the machine does not ship that detail.
[[nodiscard]] std::vector<CurveSource> CurveSourcesOf(const CurveColumn& column, std::int64_t from,
                                                      std::int64_t to);

// Returns the statement that reads a source. Its parameters:
//   $1 machine, $2 device, $3 from, $4 to (timestamptz), $5 step in seconds (of intervals only), and of positions $6: true for turns
// Its columns, for samples:            t0, n, seq0, body, stream, unit, scale
//              for a motor's readings: t, value
//              for intervals:          t (the middle), value, low, high, stream, unit
[[nodiscard]] std::string CurveSql(CurveSource source, const CurveColumn& column);

}  // namespace axlecast
