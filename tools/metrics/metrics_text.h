#pragma once

#include <cstdint>
#include <initializer_list>
#include <set>
#include <string>
#include <string_view>
#include <utility>

#include "core/base/time.h"
#include "tools/monitor/monitor.h"

namespace axlecast {

// Writes Prometheus' text exposition format, version 0.0.4: metric families, each with HELP and TYPE before its first
// sample. A family without samples is omitted.
class Exposition {
 public:
  enum class Type : std::uint8_t { kCounter, kGauge, kHistogram };
  using Labels = std::initializer_list<std::pair<std::string_view, std::string_view>>;

  // Begins a family. For a histogram, `name` is its base name.
  void Family(std::string_view name, Type type, std::string_view help);
  // Adds a sample. Label values may contain any bytes. A duplicate sample is omitted: it would make the whole text invalid.
  void Add(Labels labels, double value) { Add("", labels, value); }
  void Add(Labels labels, std::int64_t value) { Add("", labels, value); }
  // `suffix`: "_bucket", "_sum" or "_count" of a histogram.
  void Add(std::string_view suffix, Labels labels, double value);
  void Add(std::string_view suffix, Labels labels, std::int64_t value);

  [[nodiscard]] const std::string& text() const { return text_; }

 private:
  void AddText(std::string_view suffix, Labels labels, std::string_view value);

  std::string name_;
  std::string header_;             // of the family, until it has a sample
  std::set<std::string> samples_;  // of the family
  std::string text_;
};

// Returns the shortest digits that parse to the same number; or "+Inf", "-Inf", "NaN".
[[nodiscard]] std::string MetricNumber(double value);

// Returns all metrics of the machine for Prometheus: docs/metrics.md. `version`: of axlecast.
[[nodiscard]] std::string MetricsText(const Monitor& monitor, MonoNs now, std::string_view version);

}  // namespace axlecast
