#pragma once

#include <algorithm>
#include <array>
#include <cstdint>
#include <initializer_list>
#include <optional>
#include <set>
#include <string>
#include <string_view>
#include <utility>

namespace axlecast {

// Prometheus' text exposition format, version 0.0.4: metric families, one after the other, each with HELP and TYPE
// before its first sample. A family without samples leaves no trace.
class Exposition {
 public:
  enum class Type : std::uint8_t { kCounter, kGauge, kHistogram };
  using Labels = std::initializer_list<std::pair<std::string_view, std::string_view>>;

  // Begins a family; of a histogram, its base name.
  void Family(std::string_view name, Type type, std::string_view help);
  // Label values may be any bytes. A sample that the family has already is left out: it would void the whole text.
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

// The shortest digits that read back as the same number; "+Inf", "-Inf", "NaN".
[[nodiscard]] std::string MetricNumber(double value);

// A state as Prometheus wants it: one sample for each of `names`, 1 for the present one, else 0. The last of `names` is
// for one that nobody tells any more, or that is not known.
template <std::size_t N>
void AddStateSet(Exposition& out, std::string_view label, std::string_view whose,
                 const std::array<std::string_view, N>& names, std::optional<std::int8_t> state) {
  const bool known = state && *state >= 0 && static_cast<std::size_t>(*state) < N - 1;
  const std::size_t present = known ? static_cast<std::size_t>(*state) : N - 1;
  for (std::size_t i = 0; i < N; ++i) out.Add({{label, whose}, {"state", names[i]}}, std::int64_t{i == present});
}

}  // namespace axlecast
