#pragma once

#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "core/base/result.h"
#include "tools/web/fleet_request.h"

namespace axlecast {

// A sample, or an interval with the least and the greatest value. NaN: not valid.
struct FleetCurvePoint {
  std::int64_t utime = 0;
  double value = 0;
  double low = 0;
  double high = 0;
  std::int64_t stream = 0;  // points of different streams are not connected

  bool operator==(const FleetCurvePoint&) const = default;
};

struct FleetCurve {
  std::string unit = {};
  std::int64_t step_us = 0;  // 0: the points are samples
  std::vector<FleetCurvePoint> points = {};
};

// One row of axlecast.position_chunk.
struct StoredChunk {
  std::int64_t t0 = 0;  // us, UNIX time
  std::int64_t n = 0;
  std::int64_t seq0 = 0;
  std::string_view body;
  std::int64_t stream = 0;
  double scale = 1;  // unit per count
};

// Appends the samples of `chunk` that are within from <= t < to. Fails on a damaged body.
[[nodiscard]] Result<> AppendSamples(std::vector<FleetCurvePoint>& points, const StoredChunk& chunk,
                                     std::int64_t from, std::int64_t to);

// Joins the points of one interval each, so that a curve has at most kMaxCurvePoints and keeps its peaks. Changes nothing
// if there are not more.
void Thin(FleetCurve& curve, std::int64_t from, std::int64_t to);

// Returns the frame `fleet_curve`.
[[nodiscard]] std::string CurveFrame(const FleetRequest& request, const FleetCurve& curve);

}  // namespace axlecast
