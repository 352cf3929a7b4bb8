#include "core/base/spelling.h"

#include <charconv>
#include <cmath>
#include <cstddef>
#include <numeric>
#include <utility>

#include "core/base/text.h"

namespace axlecast {
namespace {

// A name in the file is never longer; what is, resembles nothing.
constexpr std::size_t kLongestWord = 64;

// Insertions, deletions, exchanges and swaps of neighbours that lead from one word to the other.
std::size_t EditDistance(std::string_view from, std::string_view to) {
  std::vector<std::size_t> before(to.size() + 1);
  std::vector<std::size_t> last(to.size() + 1);
  std::vector<std::size_t> row(to.size() + 1);
  std::iota(last.begin(), last.end(), std::size_t{0});
  for (std::size_t i = 1; i <= from.size(); ++i) {
    row[0] = i;
    for (std::size_t j = 1; j <= to.size(); ++j) {
      const std::size_t exchange = last[j - 1] + (from[i - 1] == to[j - 1] ? 0 : 1);
      row[j] = std::min({last[j] + 1, row[j - 1] + 1, exchange});
      if (i > 1 && j > 1 && from[i - 1] == to[j - 2] && from[i - 2] == to[j - 1]) {
        row[j] = std::min(row[j], before[j - 2] + 1);
      }
    }
    std::swap(before, last);
    std::swap(last, row);
  }
  return last[to.size()];
}

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

// Returns the number before a unit, multiplied by the unit; nothing if it is not a number from 0 to `maximum`.
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

std::optional<std::string> NearestWord(std::string_view word, const std::vector<std::string>& known) {
  if (word.empty() || word.size() > kLongestWord) return std::nullopt;
  std::optional<std::string> nearest;
  std::size_t smallest = std::max<std::size_t>(2, word.size() / 3) + 1;
  for (const std::string& candidate : known) {
    const bool shortened = word.size() >= 3 && candidate.starts_with(word);
    const std::size_t distance = shortened ? 1 : EditDistance(word, candidate);
    if (distance >= smallest || distance >= candidate.size()) continue;
    smallest = distance;
    nearest = candidate;
  }
  return nearest;
}

std::string Suggestion(std::string_view word, const std::vector<std::string>& known, const std::string& otherwise) {
  const std::optional<std::string> near = NearestWord(word, known);
  return near ? "; did you mean " + Quoted(*near) + "?" : otherwise;
}

std::string Listed(const std::vector<std::string>& words) {
  std::string text;
  for (const std::string& word : words) {
    if (!text.empty()) text += ", ";
    text += word;
  }
  return text;
}

std::string Quoted(std::string_view value) {
  constexpr std::size_t kShown = 40;
  const std::string_view begin = Shortened(value, kShown);
  return "'" + TerminalText(begin, TextShape::kOneLine) + (begin.size() < value.size() ? "...'" : "'");
}

std::optional<std::int64_t> ParseInteger(std::string_view text, std::int64_t min, std::int64_t max) {
  std::int64_t value = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  if (error != std::errc() || end != text.data() + text.size() || value < min || value > max) return std::nullopt;
  return value;
}

bool IsName(std::string_view text) {
  constexpr std::size_t kLongest = 24;
  return !text.empty() && text.size() <= kLongest &&
         text.find_first_not_of("abcdefghijklmnopqrstuvwxyz0123456789_-") == std::string_view::npos;
}

std::optional<MonoNs> ParseTime(std::string_view text) { return Parse(text, kTimes, kMaxTime); }

std::string FormatTime(MonoNs time) { return Text(time, kTimes); }

std::optional<std::int64_t> ParseSize(std::string_view text) { return Parse(text, kSizes, kMaxSize); }

std::string FormatSize(std::int64_t bytes) { return Text(bytes, kSizes); }

}  // namespace axlecast
