#include "drivers/kit/simulation/quantity.h"

#include <algorithm>
#include <charconv>
#include <sstream>

namespace axlecast {
namespace {

std::string Quoted(std::string_view text) { return "'" + std::string(text) + "'"; }

}  // namespace

Result<double> ParseNumber(std::string_view text, double min, double max, std::string_view unit) {
  double value = 0;
  const char* const end = text.data() + text.size();
  const auto [stopped, error] = std::from_chars(text.data(), end, value);
  // The comparison refuses NaN too.
  if (error == std::errc() && stopped == end && value >= min && value <= max) return value;
  std::string why = Quoted(text) + " is not a number from " + NumberText(min) + " to " + NumberText(max);
  if (!unit.empty()) why.append(" ").append(unit);
  return Failure(std::move(why));
}

Result<std::int64_t> ParseWholeNumber(std::string_view text, double min, double max, std::string_view unit) {
  const Result<double> number = ParseNumber(text, min, max, unit);
  if (!number) return Failure(number.error());
  if (*number != std::floor(*number)) return Failure(Quoted(text) + " is not a whole number");
  return static_cast<std::int64_t>(*number);
}

Result<std::size_t> ParseChoice(std::string_view text, std::span<const std::string_view> words) {
  const auto found = std::find(words.begin(), words.end(), text);
  if (found != words.end()) return static_cast<std::size_t>(found - words.begin());
  std::string list;
  for (const std::string_view word : words) list += (list.empty() ? "" : ", ") + std::string(word);
  return Failure(Quoted(text) + " is not one of " + list);
}

std::string NumberText(double value) {
  std::ostringstream text;
  text.precision(12);
  text << value;
  return text.str();
}

}  // namespace axlecast
