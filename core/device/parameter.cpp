#include "core/device/parameter.h"

#include <algorithm>

namespace axlecast {
namespace {

// The digits of a number with at most `decimals` places that count, as whole register units; nothing when the text is
// no such number.
std::optional<std::int64_t> Scaled(std::string_view text, int decimals, bool& too_fine) {
  constexpr std::size_t kMaxDigits = 12;
  std::int64_t value = 0;
  int places = -1;  // -1: before the point
  std::size_t digits = 0;
  for (const char c : text) {
    if (c == '.' && places < 0) {
      places = 0;
      continue;
    }
    if (c < '0' || c > '9' || ++digits > kMaxDigits) return std::nullopt;
    if (places < 0 || places < decimals) {
      value = 10 * value + (c - '0');
    } else if (c != '0') {
      too_fine = true;
    }
    if (places >= 0) ++places;
  }
  if (digits == 0) return std::nullopt;
  for (int place = std::max(places, 0); place < decimals; ++place) value *= 10;
  return value;
}

}  // namespace

std::string ParameterText(const ParameterSpec& parameter, std::uint16_t raw) {
  std::string digits = std::to_string(raw);
  if (parameter.decimals == 0) return digits;
  const auto decimals = static_cast<std::size_t>(parameter.decimals);
  if (digits.size() <= decimals) digits.insert(0, decimals + 1 - digits.size(), '0');
  return digits.insert(digits.size() - decimals, ".");
}

Result<std::uint16_t> ParseParameter(const ParameterSpec& parameter, std::string_view text) {
  const std::string suffix = " " + std::string(parameter.unit);
  if (text.ends_with(suffix)) text.remove_suffix(suffix.size());
  const std::string range = ParameterText(parameter, static_cast<std::uint16_t>(parameter.min)) + " to " +
                            ParameterText(parameter, static_cast<std::uint16_t>(parameter.max)) + suffix;
  const std::string name(parameter.name);
  bool too_fine = false;
  const std::optional<std::int64_t> value = Scaled(text, parameter.decimals, too_fine);
  if (!value) return Failure(name + " must be a number, " + range);
  if (too_fine) {
    return Failure(name + " has steps of " + ParameterText(parameter, 1) + suffix + ": give it in whole steps");
  }
  if (*value < parameter.min || *value > parameter.max) return Failure(name + " must be " + range);
  return static_cast<std::uint16_t>(*value);
}

}  // namespace axlecast
