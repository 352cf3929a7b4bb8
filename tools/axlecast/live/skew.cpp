#include "tools/axlecast/live/skew.h"

#include <array>
#include <cstdlib>
#include <nlohmann/json.hpp>

#include "core/base/text.h"

namespace axlecast {
namespace {

double Microseconds(MonoNs ns) { return static_cast<double>(ns) * 1e-3; }
double Microseconds(double ns) { return ns * 1e-3; }
std::string UsText(MonoNs ns) { return Text("%.1f us", Microseconds(ns)); }

using Cells = std::array<std::string, 8>;
constexpr std::array<std::size_t, 7> kWidths = {9, 16, 16, 16, 9, 11, 14};  // of the cells after the name

std::string Row(const Cells& cells) {
  std::string line = Left(cells[0], kNameBytes);
  for (std::size_t i = 1; i < cells.size(); ++i) line += Right(cells.at(i), kWidths.at(i - 1));
  return line;
}

constexpr double kHalf = 0.5;
constexpr double kMost = 0.99;

}  // namespace

SkewStatistics::SkewStatistics(std::vector<std::string> axes) {
  for (std::string& device : axes) axes_.push_back({.device = std::move(device)});
}

void SkewStatistics::On(const position_set_t& set) {
  ++ticks_;
  limit_ = set.limit_ns;
  if (set.state == position_set_t::STATE_ALIGNED) ++aligned_;
  if (set.state == position_set_t::STATE_INCOMPLETE) {
    ++incomplete_;
  } else {
    hull_.Add(set.latest_ns - set.earliest_ns);
  }
  for (std::size_t i = 0; i < axes_.size() && i < set.axes.size(); ++i) {
    const position_set_axis_t& reading = set.axes[i];
    Axis& axis = axes_[i];
    switch (reading.state) {
      case position_set_axis_t::STATE_GOOD:
        ++axis.good;
        axis.sum_ns += reading.offset_ns;
        axis.distance.Add(std::abs(std::int64_t{reading.offset_ns}));
        axis.half_width.Add(reading.half_width_ns);
        break;
      case position_set_axis_t::STATE_MISSING:
        ++axis.missing;
        break;
      case position_set_axis_t::STATE_NOT_VALID:
        ++axis.not_valid;
        break;
      default:
        ++axis.time_unknown;
    }
  }
}

double SkewStatistics::Share(std::int64_t count) const {
  return ticks_ == 0 ? 0 : static_cast<double>(count) / static_cast<double>(ticks_);
}

std::vector<std::string> SkewStatistics::Lines() const {
  const std::int64_t wider = hull_.count() - aligned_;
  std::vector<std::string> lines;
  lines.push_back(Text("%lld ticks: %.2f %% aligned within %s, %.2f %% wider, %.2f %% incomplete",
                       static_cast<long long>(ticks_), 100 * Share(aligned_), UsText(limit_).c_str(),
                       100 * Share(wider), 100 * Share(incomplete_)));
  if (hull_.count() > 0) {
    lines.push_back("hull of the sampling instants: p50 " + UsText(hull_.Percentile(kHalf)) + ", p99 " +
                    UsText(hull_.Percentile(kMost)) + ", max " + UsText(hull_.max()));
  }
  lines.push_back(Row({"AXIS", "GOOD", "MEAN FROM TICK", "P99 FROM TICK", "P50 HALF WIDTH", "MISSING", "NOT VALID",
                       "TIME UNKNOWN"}));
  for (const Axis& axis : axes_) {
    const bool any = axis.good > 0;
    lines.push_back(Row({Printable(axis.device), std::to_string(axis.good),
                         any ? Text("%+.1f us", Microseconds(axis.MeanNs())) : "-",
                         any ? UsText(axis.distance.Percentile(kMost)) : "-",
                         any ? UsText(axis.half_width.Percentile(kHalf)) : "-", std::to_string(axis.missing),
                         std::to_string(axis.not_valid), std::to_string(axis.time_unknown)}));
  }
  return lines;
}

nlohmann::ordered_json SkewStatistics::ToJson() const {
  nlohmann::ordered_json json;
  json["ticks"] = ticks_;
  json["aligned"] = aligned_;
  json["wider"] = hull_.count() - aligned_;
  json["incomplete"] = incomplete_;
  json["limit_us"] = Microseconds(limit_);
  const auto percentiles = [](const ExchangeStats& stats) -> nlohmann::ordered_json {
    if (stats.count() == 0) return nullptr;
    return {{"p50", Microseconds(stats.Percentile(kHalf))},
            {"p99", Microseconds(stats.Percentile(kMost))},
            {"max", Microseconds(stats.max())}};
  };
  json["hull_us"] = percentiles(hull_);
  json["axes"] = nlohmann::ordered_json::array();
  for (const Axis& axis : axes_) {
    nlohmann::ordered_json each = {{"device", axis.device},
                                   {"good", axis.good},
                                   {"missing", axis.missing},
                                   {"not_valid", axis.not_valid},
                                   {"time_unknown", axis.time_unknown}};
    each["mean_from_tick_us"] = axis.good > 0 ? nlohmann::ordered_json(Microseconds(axis.MeanNs())) : nullptr;
    each["from_tick_us"] = percentiles(axis.distance);
    each["half_width_us"] = percentiles(axis.half_width);
    json["axes"].push_back(std::move(each));
  }
  return json;
}

}  // namespace axlecast
