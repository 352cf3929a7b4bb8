#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "tools/mqtt/sparkplug/payload.h"

namespace axlecast {

// Quality codes of specification 3.0.0, chapter 6.
inline constexpr std::int32_t kQualityBad = 0, kQualityGood = 192, kQualityStale = 500;

// One metric as a message of LCM states it.
struct MetricReading {
  std::string name;
  SparkplugType type = SparkplugType::kInt32;
  SparkplugValue value = {};
  std::vector<SparkplugProperty> properties = {};
  std::optional<std::int32_t> quality = std::nullopt;  // property Quality; none: the metric has no such property
  bool is_transient = false;                           // an event: the value is not kept for the next birth
  bool only_in_births = false;  // a change requires a new birth, as a change of type or engUnit does
};

// The metrics of the node or of one device, with their aliases and current values.
class MetricTable {
 public:
  // `next_alias`: counts the aliases of the node, which are unique over all its tables. An alias never changes.
  explicit MetricTable(std::uint64_t& next_alias) : next_alias_(&next_alias) {}

  // Adds a metric. Its value, usually null, is sent in births until the first reading.
  void Define(MetricReading definition);

  struct Changes {
    bool needs_birth = false;              // a metric is new or has another definition
    std::vector<SparkplugMetric> metrics;  // those that have changed, by alias
  };
  // Takes the readings as current values.
  [[nodiscard]] Changes Apply(const std::vector<MetricReading>& readings, std::int64_t timestamp_ms);
  // Marks the quality of the current values as stale. The metrics without a quality do not change.
  [[nodiscard]] std::vector<SparkplugMetric> MarkStale(std::int64_t timestamp_ms);

  // Returns every metric with name, alias and current value, in the order of time. `now_ms`: time of metrics without a value.
  [[nodiscard]] std::vector<SparkplugMetric> Birth(std::int64_t now_ms) const;

  // Returns the readings as historical values, by alias. Defines metrics that are new: then `needs_birth` is true, and the birth
  // must precede the returned metrics.
  [[nodiscard]] Changes Historical(const std::vector<MetricReading>& readings, std::int64_t timestamp_ms);

  [[nodiscard]] const std::vector<MetricReading>& metrics() const { return metrics_; }  // with their current values

 private:
  struct Known {
    std::uint64_t alias = 0;
    std::int64_t timestamp_ms = 0;  // of the current value; 0: there is no value yet
  };

  [[nodiscard]] std::size_t IndexOf(const MetricReading& reading, bool& needs_birth);
  [[nodiscard]] SparkplugMetric Data(std::size_t index, const MetricReading& reading,
                                     std::int64_t timestamp_ms) const;

  std::uint64_t* next_alias_;
  std::vector<MetricReading> metrics_;
  std::vector<Known> known_;  // of each
  std::map<std::string, std::size_t, std::less<>> by_name_;
};

}  // namespace axlecast
