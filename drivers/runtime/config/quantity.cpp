#include "drivers/runtime/config/quantity.h"

#include <charconv>
#include <cmath>
#include <initializer_list>
#include <utility>

namespace axlecast {
namespace {

using Units = std::initializer_list<std::pair<std::string_view, double>>;

// The number before one of the units, times the unit; nothing where it is none from 0 to `most`.
std::optional<std::int64_t> Parse(std::string_view text, const Units& units, double most) {
  double number = 0;
  const auto [end, error] =
      std::from_chars(text.data(), text.data() + text.size(), number, std::chars_format::fixed);
  if (error != std::errc()) return std::nullopt;
  const std::string_view unit = text.substr(static_cast<std::size_t>(end - text.data()));
  for (const auto& [name, factor] : units) {
    if (unit != name) continue;
    const double value = number * factor;
    return value >= 0 && value <= most ? std::optional(std::llround(value)) : std::nullopt;
  }
  return std::nullopt;
}

}  // namespace

std::optional<MonoNs> ParseTime(std::string_view text) {
  constexpr double kDay = 86'400e9;
  constexpr double kYear = 365.25 * kDay;
  return Parse(text, {{"s", 1e9}, {"m", 60e9}, {"h", 3'600e9}, {"d", kDay}, {"w", 7 * kDay}, {"y", kYear}},
               200 * kYear);
}

std::optional<std::int64_t> ParseSize(std::string_view text) {
  constexpr double kKilo = 1'024;
  return Parse(
      text,
      {{"kB", kKilo}, {"MB", kKilo * kKilo}, {"GB", kKilo * kKilo * kKilo}, {"TB", kKilo * kKilo * kKilo * kKilo}},
      std::pow(kKilo, 5));
}

}  // namespace axlecast
