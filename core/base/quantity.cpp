#include "core/base/quantity.h"

#include <array>
#include <charconv>
#include <cmath>
#include <utility>

namespace axlecast {
namespace {

struct Unit {
  std::string_view name;
  std::int64_t factor;
};

constexpr std::int64_t kDay = 86'400 * kSecond;
constexpr std::int64_t kYear = kDay / 4 * 1'461;  // of 365.25 days
constexpr std::array kTimes = {Unit{"s", kSecond}, Unit{"m", 60 * kSecond}, Unit{"h", 3'600 * kSecond},
                               Unit{"d", kDay},    Unit{"w", 7 * kDay},     Unit{"y", kYear}};
constexpr std::array kSizes = {Unit{"kB", 1LL << 10}, Unit{"MB", 1LL << 20}, Unit{"GB", 1LL << 30},
                               Unit{"TB", 1LL << 40}};
constexpr std::int64_t kMaxTime = 200 * kYear;
constexpr std::int64_t kMaxSize = 1LL << 50;

// The number before one of the units, times the unit; nothing where it is none from 0 to `most`.
template <std::size_t kUnits>
std::optional<std::int64_t> Parse(std::string_view text, const std::array<Unit, kUnits>& units,
                                  std::int64_t maximum) {
  double number = 0;
  const auto [end, error] =
      std::from_chars(text.data(), text.data() + text.size(), number, std::chars_format::fixed);
  if (error != std::errc()) return std::nullopt;
  const std::string_view name = text.substr(static_cast<std::size_t>(end - text.data()));
  for (const Unit& unit : units) {
    if (name != unit.name) continue;
    const double value = number * static_cast<double>(unit.factor);
    return value >= 0 && value <= static_cast<double>(maximum) ? std::optional(std::llround(value)) : std::nullopt;
  }
  return std::nullopt;
}

// In the largest unit that leaves no fraction, else in the smallest one.
template <std::size_t kUnits>
std::string Text(std::int64_t value, const std::array<Unit, kUnits>& units) {
  Unit unit = units.front();
  for (const Unit& larger : units) {
    if (value % larger.factor == 0) unit = larger;
  }
  std::array<char, 32> number{};
  const auto [end, error] = std::to_chars(number.data(), number.data() + number.size(),
                                          static_cast<double>(value) / static_cast<double>(unit.factor));
  return std::string(number.data(), end).append(unit.name);
}

}  // namespace

std::optional<MonoNs> ParseTime(std::string_view text) { return Parse(text, kTimes, kMaxTime); }

std::string FormatTime(MonoNs time) { return Text(time, kTimes); }

std::optional<std::int64_t> ParseSize(std::string_view text) { return Parse(text, kSizes, kMaxSize); }

std::string FormatSize(std::int64_t bytes) { return Text(bytes, kSizes); }

}  // namespace axlecast
