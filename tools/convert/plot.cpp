#include "tools/convert/plot.h"

#include <algorithm>
#include <axlecast/position_block_t.hpp>
#include <axlecast/position_t.hpp>
#include <bit>
#include <cmath>
#include <limits>
#include <map>
#include <set>
#include <utility>

#include "core/messages/enum_names.h"
#include "core/messages/json/message_json.h"
#include "core/messages/message.h"
#include "tools/convert/chart.h"

namespace axlecast {
namespace {

using Json = nlohmann::ordered_json;

constexpr double kMaxValue = 1e300;  // an axis cannot be computed for larger values

// Longer endings first.
constexpr std::pair<std::string_view, std::string_view> kUnits[] = {
    {"_rad_s", "rad/s"}, {"_rad", "rad"}, {"_mps2", "m/s²"},    {"bytes_hz", "B/s"},
    {"_hz", "Hz"},       {"_bytes", "B"}, {"_ns", "ns"},        {"_us", "µs"},
    {"_ms", "ms"},       {"_v", "V"},     {"_a", "A"},          {"_w", "W"},
    {"_c", "°C"},        {"utime", "µs"}, {"counts", "counts"}, {"raw_turns", "turns"}};

std::int64_t ToMicroseconds(std::int64_t ns) { return ns / 1'000; }

// Result of the first pass over the log.
struct Times {
  std::map<std::string, MessageGap, std::less<>> gaps;  // by channel; only the channels to draw
  std::set<std::string, std::less<>> others;            // the other channels
  std::int64_t first = std::numeric_limits<std::int64_t>::max();
  std::int64_t last = 0;
};

// Returns the time of the last reading of a message whose first reading is at `us`.
std::int64_t LastReading(const LogEvent& event, std::int64_t us) {
  const auto block = DecodeMessage<position_block_t>(event.data);
  return block && !block->dt_ns.empty() ? us + ToMicroseconds(std::max(block->dt_ns.back(), 0)) : us;
}

Times SurveyTimes(const EventRange& events, const std::vector<PlotField>& fields) {
  Times times;
  std::set<std::string, std::less<>> selected;
  for (const PlotField& field : fields) selected.insert(field.channel);
  events([&](const LogEvent& event) {
    if (!selected.contains(event.channel)) {
      if (!times.others.contains(event.channel)) times.others.emplace(event.channel);
      return true;
    }
    const std::int64_t us = SampleTime(event);
    auto place = times.gaps.find(event.channel);
    if (place == times.gaps.end()) place = times.gaps.try_emplace(std::string(event.channel)).first;
    place->second.On(us);
    times.first = std::min(times.first, us);
    times.last = std::max(times.last, LastReading(event, us));
    return true;
  });
  return times;
}

// Returns false for a position field if the reading's flags mark it as not valid.
bool Usable(std::string_view field, const Json& flags) {
  const bool of_position = field == "value" || field == "angle_rad" || field == "counts";
  return !of_position || !flags.is_number_integer() ||
         (flags.get<std::int64_t>() & std::int64_t{position_t::FLAG_VALID}) != 0;
}

// Collects the readings of one curve.
class CurveSource {
 public:
  CurveSource(PlotField field, const Times& times, std::int64_t gap_us, std::size_t columns)
      : field_(std::move(field)), curve_(times.first, times.last, gap_us, columns) {}

  void On(std::int64_t us, std::string_view type, const Json& message) {
    BreakAtMissingMessages(message);
    const Json* const value = FindField(message, field_.field);
    if (value == nullptr) return;
    if (unit_.empty()) unit_ = FieldUnit(message, field_.field);
    const bool flagged = type == "position_t" || type == "position_block_t";
    const Json flags = flagged ? message.at("flags") : Json();
    const auto steps = message.find("dt_ns");
    if (value->is_array() && steps != message.end() && steps->is_array() && steps->size() == value->size()) {
      for (std::size_t i = 0; i < value->size(); ++i) {
        const std::int64_t at = us + ToMicroseconds((*steps)[i].get<std::int64_t>());
        Add(at, (*value)[i], flagged ? flags[i] : Json());
      }
    } else {
      Add(us, *value, flags);
    }
  }
  [[nodiscard]] bool found() const { return found_; }
  [[nodiscard]] const PlotField& field() const { return field_; }
  [[nodiscard]] PlotCurve Make() const { return {field_, unit_, curve_.Pieces(), curve_.readings()}; }

 private:
  void BreakAtMissingMessages(const Json& message) {
    const std::int64_t seq = message.value("seq", std::int64_t{0});
    const std::string boot = message.value("boot_id", std::string());
    if (boot != boot_ || seq != next_seq_) curve_.Break();
    boot_ = boot;
    next_seq_ = seq == INT64_MAX ? 0 : seq + 1;
  }
  void Add(std::int64_t us, const Json& value, const Json& flags) {
    if (value.is_number() || value.is_null()) found_ = true;
    if (!value.is_number() || !Usable(field_.field, flags) || std::abs(value.get<double>()) > kMaxValue) {
      curve_.Break();
    } else {
      curve_.Add(us, value.get<double>());
    }
  }

  PlotField field_;
  Curve curve_;
  std::string unit_;
  std::string boot_;
  std::int64_t next_seq_ = 0;
  bool found_ = false;  // the field exists: a number, or null
};

std::string UnknownChannelText(const std::string& channel, const Times& times) {
  constexpr std::size_t kShown = 20;
  std::string text = "the selected events contain no message of " + channel + "; they contain: ";
  std::size_t shown = 0;
  for (const std::string& other : times.others) {
    if (shown++ == kShown) return text + ", ...";
    text += (shown > 1 ? ", " : "") + other;
  }
  return text + (times.others.empty() ? "none" : "");
}

std::string UnknownFieldText(const PlotField& field, const Json& message) {
  std::string text = field.channel + " has no number named " + field.field;
  std::string names;
  VisitFields(message, [&names](const std::string& name, const Json& value) {
    if (value.is_number() || value.is_null()) names += (names.empty() ? "" : ", ") + name;
  });
  return names.empty() ? text + ": its messages are not axlecast messages" : text + "; it has: " + names;
}

// px
constexpr double kPlotWidth = 1'000;
constexpr double kLeft = 100;
constexpr double kRight = kLeft + static_cast<double>(kPlotColumns);
constexpr double kHead = 40;
constexpr double kPanelHead = 24;
constexpr double kLegendRow = 18;
constexpr double kPlotHeight = 220;
constexpr double kPanelFoot = 50;

// Curves that share an axis.
struct CurveGroup {
  std::string unit;
  std::vector<std::size_t> curves;  // indexes into PlotData::curves

  [[nodiscard]] double LegendHeight() const { return kLegendRow * static_cast<double>(curves.size()); }
  [[nodiscard]] double Height() const { return kPanelHead + LegendHeight() + kPlotHeight + kPanelFoot; }
};

// Groups curves by unit. Curves without a unit share a panel if they show the same field.
std::vector<CurveGroup> GroupCurves(const PlotData& data) {
  std::vector<CurveGroup> groups;
  for (std::size_t i = 0; i < data.curves.size(); ++i) {
    const PlotCurve& curve = data.curves[i];
    const std::string unit = curve.unit.empty() ? curve.field.field : curve.unit;
    auto group = std::find_if(groups.begin(), groups.end(), [&](const CurveGroup& g) { return g.unit == unit; });
    if (group == groups.end()) group = groups.insert(groups.end(), CurveGroup{unit, {}});
    group->curves.push_back(i);
  }
  return groups;
}

RoundAxis ValueAxis(const PlotData& data, const CurveGroup& group) {
  constexpr int kTicks = 5;
  double low = INFINITY;
  double high = -INFINITY;
  for (const std::size_t number : group.curves) {
    for (const Curve::Piece& piece : data.curves[number].pieces) {
      for (const CurvePoint& point : piece) {
        low = std::min(low, point.value);
        high = std::max(high, point.value);
      }
    }
  }
  return MakeRoundAxis(low, high, kTicks);
}

// `y`: the top of the legend.
void DrawLegend(Canvas& canvas, const PlotData& data, const CurveGroup& group, double y) {
  for (const std::size_t number : group.curves) {
    y += kLegendRow;
    const PlotCurve& curve = data.curves[number];
    canvas.DrawLegendLine({kLeft, y - 10}, {kLeft + 30, y - 10}, {.number = number});
    canvas.DrawText({kLeft + 38, y - 6}, curve.field.Name() + (curve.readings == 0 ? " (no reading)" : ""), {});
  }
}

void DrawGroup(Canvas& canvas, const PlotData& data, const CurveGroup& group, double top) {
  constexpr int kTimeTicks = 8;
  const double head = top + kPanelHead;
  const double plot_top = head + group.LegendHeight();
  const auto first_us = static_cast<double>(data.first_us);
  const ChartPanel panel = {.left = kLeft,
                            .right = kRight,
                            .top = plot_top,
                            .bottom = plot_top + kPlotHeight,
                            .first_x = first_us,
                            .last_x = std::max(static_cast<double>(data.last_us), first_us + 1),
                            .values = ValueAxis(data, group)};
  const TimeAxis times = MakeTimeAxis(data.first_us, data.last_us, kTimeTicks);
  canvas.DrawText({kLeft, head - 8}, group.unit, {.bold = true});
  DrawLegend(canvas, data, group, head);
  DrawAxes(canvas, panel, times.ticks, times.title);
  for (const std::size_t number : group.curves) {
    std::vector<Canvas::Polyline> polylines;
    for (const Curve::Piece& piece : data.curves[number].pieces) {
      Canvas::Polyline& points = polylines.emplace_back();
      for (const CurvePoint& point : piece) {
        points.push_back(panel.At(static_cast<double>(point.us), point.value));
      }
    }
    canvas.DrawCurve(polylines, {.number = number});
  }
}

double Height(const PlotData& data) {
  double height = kHead;
  for (const CurveGroup& group : GroupCurves(data)) height += group.Height();
  return height;
}

Result<std::string> Draw(Canvas& canvas, const std::string& title, const PlotData& data) {
  canvas.DrawText({kLeft, 26}, title, {.bold = true});
  double top = kHead;
  for (const CurveGroup& group : GroupCurves(data)) {
    DrawGroup(canvas, data, group, top);
    top += group.Height();
  }
  return canvas.Finish();
}

}  // namespace

Curve::Curve(std::int64_t first_us, std::int64_t last_us, std::int64_t gap_us, std::size_t columns)
    : first_us_(first_us), last_us_(std::max(first_us, last_us)), gap_us_(gap_us), columns_(columns) {}

Curve::Column& Curve::At(std::int64_t us) {
  const double part = (static_cast<double>(us) - static_cast<double>(first_us_)) /
                      std::max(static_cast<double>(last_us_) - static_cast<double>(first_us_), 1.0);
  const auto columns = static_cast<double>(columns_.size());
  return columns_[static_cast<std::size_t>(std::clamp(part * columns, 0.0, columns - 1))];
}

void Curve::Add(std::int64_t us, double value) {
  us = std::clamp(us, first_us_, last_us_);
  if (us < newest_us_ || us - newest_us_ > gap_us_) joins_ = false;
  const CurvePoint point{us, value};
  Column& column = At(us);
  if (!column.used) {
    column = {.used = true, .joined = joins_, .first = point, .lowest = point, .highest = point, .last = point};
  }
  if (us < column.first.us) column.first = point;
  if (value < column.lowest.value) column.lowest = point;
  if (value > column.highest.value) column.highest = point;
  if (us >= column.last.us) column.last = point;
  joins_ = true;
  newest_us_ = us;
  ++readings_;
}

std::vector<Curve::Piece> Curve::Pieces() const {
  std::vector<Piece> pieces;
  for (const Column& column : columns_) {
    if (!column.used) continue;
    if (pieces.empty() || !column.joined) pieces.emplace_back();
    Piece points = {column.first, column.lowest, column.highest, column.last};
    std::stable_sort(points.begin() + 1, points.end() - 1,
                     [](const CurvePoint& a, const CurvePoint& b) { return a.us < b.us; });
    points.erase(std::unique(points.begin(), points.end()), points.end());
    pieces.back().insert(pieces.back().end(), points.begin(), points.end());
  }
  return pieces;
}

void MessageGap::On(std::int64_t us) {
  if (last_us_ >= 0 && us > last_us_) {
    const auto power = static_cast<std::size_t>(std::bit_width(static_cast<std::uint64_t>(us - last_us_)));
    ++counts_[std::min(power, kPowers - 1)];
    ++total_;
  }
  last_us_ = us;
}

std::int64_t MessageGap::Limit() const {
  constexpr std::size_t kEight = 3;
  std::int64_t below = 0;
  for (std::size_t power = 0; power < kPowers; ++power) {
    below += counts_[power];
    if (below > 0 && 2 * below >= total_) return std::int64_t{1} << (power + kEight);
  }
  return INT64_MAX;
}

std::optional<PlotField> ParsePlotField(std::string_view text) {
  const std::size_t colon = text.rfind(':');
  if (colon == std::string_view::npos || colon == 0 || colon + 1 == text.size()) return std::nullopt;
  return PlotField{std::string(text.substr(0, colon)), std::string(text.substr(colon + 1))};
}

std::string FieldUnit(const nlohmann::ordered_json& message, std::string_view field) {
  const auto unit = message.find("unit");
  if (field == "value" && unit != message.end() && unit->is_number_integer()) {
    return std::string(UnitName(unit->get<std::int8_t>()));
  }
  const std::string_view name = field.substr(0, field.find('['));
  for (const auto& [ending, text] : kUnits) {
    if (name.ends_with(ending)) return std::string(text);
  }
  return "";
}

Result<PlotData> CollectPlot(const EventRange& events, const std::vector<PlotField>& fields, std::size_t columns) {
  const Times times = SurveyTimes(events, fields);
  std::multimap<std::string, CurveSource, std::less<>> sources;
  std::map<std::string, Json, std::less<>> examples;
  for (const PlotField& field : fields) {
    const auto gap = times.gaps.find(field.channel);
    if (gap == times.gaps.end()) return Failure(UnknownChannelText(field.channel, times));
    sources.emplace(field.channel, CurveSource(field, times, gap->second.Limit(), columns));
  }
  events([&](const LogEvent& event) {
    const auto [begin, end] = sources.equal_range(event.channel);
    std::string type;
    const auto message = begin == end ? std::nullopt : DecodeToJson(event.data, &type);
    const std::int64_t us = SampleTime(event);
    if (!message) return true;
    if (!examples.contains(event.channel)) examples.emplace(event.channel, *message);
    for (auto source = begin; source != end; ++source) source->second.On(us, type, *message);
    return true;
  });
  PlotData data{.first_us = times.first, .last_us = times.last, .curves = {}};
  for (const PlotField& field : fields) {
    const auto [begin, end] = sources.equal_range(field.channel);
    const auto source =
        std::find_if(begin, end, [&](const auto& s) { return s.second.field().field == field.field; });
    if (!source->second.found()) return Failure(UnknownFieldText(field, examples[field.channel]));
    data.curves.push_back(source->second.Make());
  }
  return data;
}

Result<std::string> PlotSvg(const std::string& title, const PlotData& data) {
  return Draw(*MakeSvgCanvas({kPlotWidth, Height(data)}, title), title, data);
}

Result<std::string> PlotPng(const std::string& title, const PlotData& data) {
  return Draw(*MakePngCanvas({kPlotWidth, Height(data)}), title, data);
}

}  // namespace axlecast
