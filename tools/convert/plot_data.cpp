#include "tools/convert/plot_data.h"

#include <algorithm>
#include <axlecast/position_block_t.hpp>
#include <axlecast/position_t.hpp>
#include <cmath>
#include <limits>
#include <map>
#include <optional>
#include <set>

#include "core/messages/json/message_json.h"
#include "core/messages/message.h"
#include "tools/convert/flat_fields.h"
#include "tools/convert/message_gap.h"
#include "tools/convert/sample_time.h"

namespace axlecast {
namespace {

using Json = nlohmann::ordered_json;

constexpr double kMax = 1e300;  // beyond it an axis cannot be computed

std::int64_t ToMicroseconds(std::int64_t ns) { return ns / 1'000; }

// What is known before the curves are made.
struct Times {
  std::map<std::string, MessageGap, std::less<>> gaps;  // by channel, of those that are drawn
  std::set<std::string, std::less<>> others;
  std::int64_t first = std::numeric_limits<std::int64_t>::max();
  std::int64_t last = 0;
};

// us, of the last reading of a message whose first is at `us`.
std::int64_t LastReading(const LogEvent& event, std::int64_t us) {
  const auto block = DecodeMessage<position_block_t>(event.data);
  return block && !block->dt_ns.empty() ? us + ToMicroseconds(std::max(block->dt_ns.back(), 0)) : us;
}

Times Look(const EventRange& events, const std::vector<PlotField>& fields) {
  Times times;
  std::set<std::string, std::less<>> wanted;
  for (const PlotField& field : fields) wanted.insert(field.channel);
  events([&](const LogEvent& event) {
    if (!wanted.contains(event.channel)) {
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

// A position says whether its counts, angle and value may be used.
bool Usable(std::string_view field, const Json& flags) {
  const bool of_position = field == "value" || field == "angle_rad" || field == "counts";
  return !of_position || !flags.is_number_integer() ||
         (flags.get<std::int64_t>() & std::int64_t{position_t::FLAG_VALID}) != 0;
}

// One curve in the making.
class CurveSource {
 public:
  CurveSource(PlotField field, const Times& times, std::int64_t gap_us, std::size_t columns)
      : field_(std::move(field)), curve_(times.first, times.last, gap_us, columns) {}

  void On(std::int64_t us, std::string_view type, const Json& message) {
    Follow(message);
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
  // Breaks the line where messages are missing.
  void Follow(const Json& message) {
    const std::int64_t seq = message.value("seq", std::int64_t{0});
    const std::string boot = message.value("boot_id", std::string());
    if (boot != boot_ || seq != next_seq_) curve_.Break();
    boot_ = boot;
    next_seq_ = seq == INT64_MAX ? 0 : seq + 1;
  }
  void Add(std::int64_t us, const Json& value, const Json& flags) {
    if (value.is_number() || value.is_null()) found_ = true;
    if (!value.is_number() || !Usable(field_.field, flags) || std::abs(value.get<double>()) > kMax) {
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
  bool found_ = false;  // a number, or that it is not known
};

std::string NoChannel(const std::string& channel, const Times& times) {
  constexpr std::size_t kShown = 20;
  std::string problem = "no message of " + channel + " is among these events; there are: ";
  std::size_t shown = 0;
  for (const std::string& other : times.others) {
    if (shown++ == kShown) return problem + ", ...";
    problem += (shown > 1 ? ", " : "") + other;
  }
  return problem + (times.others.empty() ? "none" : "");
}

std::string NoField(const PlotField& field, const Json& message) {
  std::string problem = field.channel + " has no number named " + field.field;
  std::string names;
  VisitFields(message, [&names](const std::string& name, const Json& value) {
    if (value.is_number() || value.is_null()) names += (names.empty() ? "" : ", ") + name;
  });
  return names.empty() ? problem + ": its messages are none of axlecast's" : problem + "; it has: " + names;
}

}  // namespace

PlotData CollectPlot(const EventRange& events, const std::vector<PlotField>& fields, std::size_t columns) {
  PlotData data;
  const Times times = Look(events, fields);
  std::multimap<std::string, CurveSource, std::less<>> sources;
  std::map<std::string, Json, std::less<>> examples;
  for (const PlotField& field : fields) {
    const auto gap = times.gaps.find(field.channel);
    if (gap == times.gaps.end()) {
      data.problem = NoChannel(field.channel, times);
      return data;
    }
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
  data.first_us = times.first;
  data.last_us = times.last;
  for (const PlotField& field : fields) {
    const auto [begin, end] = sources.equal_range(field.channel);
    const auto source =
        std::find_if(begin, end, [&](const auto& s) { return s.second.field().field == field.field; });
    if (!source->second.found()) {
      data.problem = NoField(field, examples[field.channel]);
      return data;
    }
    data.curves.push_back(source->second.Make());
  }
  return data;
}

}  // namespace axlecast
