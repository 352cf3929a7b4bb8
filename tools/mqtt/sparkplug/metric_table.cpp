#include "tools/mqtt/sparkplug/metric_table.h"

#include <algorithm>
#include <string_view>
#include <utility>

namespace axlecast {
namespace {

constexpr std::string_view kUnitKey = "engUnit";  // belongs to the definition of a metric
constexpr const char* kQualityKey = "Quality";

bool operator==(const SparkplugProperty& one, const SparkplugProperty& other) {
  return one.key == other.key && one.value == other.value;
}

bool SameProperties(const MetricReading& one, const MetricReading& other) {
  return std::equal(one.properties.begin(), one.properties.end(), other.properties.begin(), other.properties.end(),
                    [](const auto& a, const auto& b) { return a == b; });
}

SparkplugValue UnitOf(const MetricReading& reading) {
  for (const SparkplugProperty& property : reading.properties) {
    if (property.key == kUnitKey) return property.value;
  }
  return {};
}

// Returns true if the difference between the readings requires a new birth.
bool Redefines(const MetricReading& newer, const MetricReading& older) {
  return newer.type != older.type || UnitOf(newer) != UnitOf(older) ||
         (newer.only_in_births && newer.value != older.value);
}

bool Differs(const MetricReading& newer, const MetricReading& older) {
  return newer.is_transient || newer.value != older.value || newer.quality != older.quality ||
         !SameProperties(newer, older);
}

SparkplugMetric MetricOf(const MetricReading& reading, std::int64_t timestamp_ms) {
  SparkplugMetric metric{.timestamp_ms = timestamp_ms,
                         .type = reading.type,
                         .is_transient = reading.is_transient,
                         .properties = reading.properties,
                         .value = reading.value};
  if (reading.quality) metric.properties.push_back({kQualityKey, SparkplugType::kInt32, *reading.quality});
  return metric;
}

}  // namespace

void MetricTable::Define(MetricReading definition) {
  bool is_new = false;
  metrics_[IndexOf(definition, is_new)].value = std::move(definition.value);
}

std::size_t MetricTable::IndexOf(const MetricReading& reading, bool& needs_birth) {
  const auto [place, is_new] = by_name_.emplace(reading.name, metrics_.size());
  if (is_new) {
    metrics_.push_back(reading);
    metrics_.back().value = {};
    if (metrics_.back().quality) metrics_.back().quality = kQualityStale;
    known_.push_back({.alias = (*next_alias_)++});
    needs_birth = true;
  }
  return place->second;
}

SparkplugMetric MetricTable::Data(std::size_t index, const MetricReading& reading,
                                  std::int64_t timestamp_ms) const {
  SparkplugMetric metric = MetricOf(reading, timestamp_ms);
  metric.alias = known_[index].alias;
  std::erase_if(metric.properties, [](const SparkplugProperty& property) { return property.key == kUnitKey; });
  return metric;
}

MetricTable::Changes MetricTable::Apply(const std::vector<MetricReading>& readings, std::int64_t timestamp_ms) {
  Changes changes;
  for (const MetricReading& reading : readings) {
    const std::size_t index = IndexOf(reading, changes.needs_birth);
    MetricReading& current = metrics_[index];
    if (Redefines(reading, current)) changes.needs_birth = true;
    const bool has_changed = known_[index].timestamp_ms == 0 || Differs(reading, current);
    if (has_changed && !reading.only_in_births) changes.metrics.push_back(Data(index, reading, timestamp_ms));
    current = reading;
    if (current.is_transient) current.value = {};
    known_[index].timestamp_ms = timestamp_ms;
  }
  return changes;
}

std::vector<SparkplugMetric> MetricTable::MarkStale(std::int64_t timestamp_ms) {
  std::vector<SparkplugMetric> metrics;
  for (std::size_t index = 0; index < metrics_.size(); ++index) {
    MetricReading& current = metrics_[index];
    if (!current.quality || current.quality == kQualityStale) continue;
    current.quality = kQualityStale;
    known_[index].timestamp_ms = timestamp_ms;
    metrics.push_back(Data(index, current, timestamp_ms));
  }
  return metrics;
}

std::vector<SparkplugMetric> MetricTable::Birth(std::int64_t now_ms) const {
  std::vector<SparkplugMetric> metrics;
  for (std::size_t index = 0; index < metrics_.size(); ++index) {
    const std::int64_t timestamp_ms = known_[index].timestamp_ms;
    metrics.push_back(MetricOf(metrics_[index], timestamp_ms == 0 ? now_ms : timestamp_ms));
    metrics.back().name = metrics_[index].name;
    metrics.back().alias = known_[index].alias;
  }
  std::stable_sort(metrics.begin(), metrics.end(), [](const SparkplugMetric& one, const SparkplugMetric& other) {
    return one.timestamp_ms < other.timestamp_ms;
  });
  return metrics;
}

MetricTable::Changes MetricTable::Historical(const std::vector<MetricReading>& readings,
                                             std::int64_t timestamp_ms) {
  Changes changes;
  for (const MetricReading& reading : readings) {
    const std::size_t index = IndexOf(reading, changes.needs_birth);
    if (reading.only_in_births) continue;
    changes.metrics.push_back(Data(index, reading, timestamp_ms));
    changes.metrics.back().is_historical = true;
  }
  return changes;
}

}  // namespace axlecast
