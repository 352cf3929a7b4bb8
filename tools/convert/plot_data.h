#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "tools/convert/curve.h"
#include "tools/convert/event_range.h"
#include "tools/convert/plot_field.h"

namespace axlecast {

struct PlotCurve {
  PlotField field;
  std::string unit;
  std::vector<Curve::Piece> pieces;
  std::int64_t readings = 0;
};

// What a plot shows.
struct PlotData {
  std::string problem;  // why there is none, and what there is instead
  std::int64_t first_us = 0;
  std::int64_t last_us = 0;
  std::vector<PlotCurve> curves;
};

// The readings of these fields over the instants that their messages speak of, for a picture of so many columns of
// pixels. A line is interrupted where a message is missing by its `seq`, its publisher restarted, a value is not known
// or not valid, or nothing came for 8 times the usual time between messages. Of position_block_t (and whatever else
// has a list `dt_ns`) every sample is a reading.
[[nodiscard]] PlotData CollectPlot(const EventRange& events, const std::vector<PlotField>& fields,
                                   std::size_t columns);

}  // namespace axlecast
