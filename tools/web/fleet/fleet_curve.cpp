#include "tools/web/fleet/fleet_curve.h"

#include <algorithm>
#include <axlecast/position_t.hpp>
#include <cmath>
#include <limits>
#include <nlohmann/json.hpp>

#include "core/messages/json/field.h"
#include "core/messages/json/number_list.h"
#include "tools/fleet/position_chunk.h"
#include "tools/web/fleet/fleet_curve_source.h"

namespace axlecast {
namespace {

constexpr double kUnknown = std::numeric_limits<double>::quiet_NaN();

// The points of one interval, joined.
FleetCurvePoint Joined(const FleetCurvePoint* begin, const FleetCurvePoint* end, std::int64_t middle) {
  FleetCurvePoint joined = {
      .utime = middle, .value = kUnknown, .low = kUnknown, .high = kUnknown, .stream = begin->stream};
  double sum = 0;
  int valid = 0;
  for (const FleetCurvePoint* point = begin; point != end; ++point) {
    if (std::isnan(point->value)) continue;
    sum += point->value;
    ++valid;
    joined.low = std::fmin(joined.low, point->low);
    joined.high = std::fmax(joined.high, point->high);
  }
  if (valid > 0) joined.value = sum / valid;
  return joined;
}

// The points with strictly ascending times, and with a point that is not valid between two streams.
std::vector<FleetCurvePoint> Separated(const std::vector<FleetCurvePoint>& points) {
  std::vector<FleetCurvePoint> separated;
  separated.reserve(points.size());
  for (FleetCurvePoint point : points) {
    if (!separated.empty()) {
      const FleetCurvePoint before = separated.back();
      if (before.stream != point.stream) {
        separated.push_back({before.utime + 1, kUnknown, kUnknown, kUnknown, point.stream});
      }
      point.utime = std::max(point.utime, separated.back().utime + 1);
    }
    separated.push_back(point);
  }
  return separated;
}

}  // namespace

Result<> AppendSamples(std::vector<FleetCurvePoint>& points, const StoredChunk& chunk, std::int64_t from,
                       std::int64_t to) {
  PositionChunkRow row;
  row.t0 = chunk.t0;
  row.seq0 = chunk.seq0;
  row.summary.n = chunk.n;
  row.body.assign(chunk.body.begin(), chunk.body.end());
  const Result<std::vector<PositionSample>> samples = DecodePositionChunk(row, {});
  if (!samples) return Failure(samples.error());
  for (const PositionSample& sample : *samples) {
    if (sample.utime < from || sample.utime >= to) continue;
    const bool valid = (sample.flags & position_t::FLAG_VALID) != 0;
    const double value = valid ? static_cast<double>(sample.counts) * chunk.scale : kUnknown;
    points.push_back({sample.utime, value, value, value, chunk.stream});
  }
  return {};
}

void Thin(FleetCurve& curve, std::int64_t from, std::int64_t to) {
  std::vector<FleetCurvePoint>& points = curve.points;
  if (points.size() <= static_cast<std::size_t>(kMaxCurvePoints)) return;
  const std::int64_t step = (to - from) / kMaxCurvePoints + 1;
  std::vector<FleetCurvePoint> thinned;
  for (std::size_t begin = 0; begin < points.size();) {
    const std::int64_t interval = (points[begin].utime - from) / step;
    std::size_t end = begin + 1;
    while (end < points.size() && points[end].stream == points[begin].stream &&
           (points[end].utime - from) / step == interval) {
      ++end;
    }
    thinned.push_back(Joined(points.data() + begin, points.data() + end, from + interval * step + step / 2));
    begin = end;
  }
  curve.step_us = step;
  points = std::move(thinned);
}

std::string CurveFrame(const FleetRequest& request, const FleetCurve& curve) {
  const std::vector<FleetCurvePoint> points = Separated(curve.points);
  const std::int64_t start = points.empty() ? request.from : points.front().utime;
  std::string text = JsonLine({{"type", "fleet_curve"},
                               {"id", request.id},
                               {"device", request.device},
                               {"column", request.column},
                               {"unit", curve.unit},
                               {"step_us", curve.step_us},
                               {"from_utime", request.from},
                               {"to_utime", request.to},
                               {"t0_utime", start}});
  text.back() = ',';  // its closing brace
  const auto append = [&](const char* name, const auto& value) {
    text += name;
    AppendList(text, std::size_t{0}, points.size(), value);
  };
  const auto number = [&](double FleetCurvePoint::*member) {
    return [&text, &points, member](std::size_t i) { AppendNumber(text, points[i].*member); };
  };
  append(R"("dt_us":)", [&](std::size_t i) { text += std::to_string(points[i].utime - start); });
  append(R"(,"value":)", number(&FleetCurvePoint::value));
  if (curve.step_us > 0) {
    append(R"(,"low":)", number(&FleetCurvePoint::low));
    append(R"(,"high":)", number(&FleetCurvePoint::high));
  }
  return text + '}';
}

}  // namespace axlecast
