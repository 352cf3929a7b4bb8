#include "tools/axlecast/common/utc_text.h"

#include <array>
#include <charconv>
#include <cstdio>
#include <ctime>
#include <initializer_list>

namespace axlecast {
namespace {

constexpr std::int64_t kSecondUs = 1'000'000;

// A number of exactly `digits` digits at the start of `text`, which is taken off.
std::optional<int> TakeDigits(std::string_view& text, std::size_t digits) {
  if (text.size() < digits) return std::nullopt;
  int value = 0;
  for (const char c : text.substr(0, digits)) {
    if (c < '0' || c > '9') return std::nullopt;
    value = 10 * value + (c - '0');
  }
  text.remove_prefix(digits);
  return value;
}

bool Take(std::string_view& text, std::string_view any_of) {
  if (text.empty() || any_of.find(text.front()) == std::string_view::npos) return false;
  text.remove_prefix(1);
  return true;
}

std::optional<std::int64_t> ParseAge(std::string_view text) {
  std::int64_t amount = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), amount);
  if (error != std::errc() || end + 1 != text.data() + text.size()) return std::nullopt;
  if (amount < 0 || amount > 100'000'000) return std::nullopt;  // beyond any journal
  switch (*end) {
    case 's':
      return amount * kSecondUs;
    case 'm':
      return amount * 60 * kSecondUs;
    case 'h':
      return amount * 3'600 * kSecondUs;
    case 'd':
      return amount * 86'400 * kSecondUs;
    case 'w':
      return amount * 604'800 * kSecondUs;
    default:
      return std::nullopt;
  }
}

// "07:00" or "07:00:05" into `parts`.
bool ParseTimeOfDay(std::string_view& text, std::tm& parts) {
  const auto hour = TakeDigits(text, 2);
  if (!hour || !Take(text, ":")) return false;
  const auto minute = TakeDigits(text, 2);
  const bool with_second = minute && Take(text, ":");
  const auto second = with_second ? TakeDigits(text, 2) : std::optional(0);
  if (!minute || !second || *hour > 23 || *minute > 59 || *second > 60) return false;
  parts.tm_hour = *hour;
  parts.tm_min = *minute;
  parts.tm_sec = *second;
  return true;
}

}  // namespace

std::string UtcText(std::int64_t utime) {
  const std::time_t seconds = utime / kSecondUs;
  std::tm parts{};
  std::array<char, 32> text{};
  if (gmtime_r(&seconds, &parts) == nullptr ||
      std::strftime(text.data(), text.size(), "%Y-%m-%d %H:%M:%S", &parts) == 0) {
    return "?";
  }
  return text.data();
}

std::string UtcMillisecondText(std::int64_t utime) {
  std::array<char, 8> text{};
  static_cast<void>(std::snprintf(text.data(), text.size(), ".%03d", static_cast<int>(utime % kSecondUs / 1'000)));
  return UtcText(utime) + text.data();
}

std::optional<std::int64_t> ParseUtc(std::string_view text, std::int64_t now) {
  if (const auto age = ParseAge(text)) return now - *age;
  std::tm parts{};
  const auto year = TakeDigits(text, 4);
  if (!year || !Take(text, "-")) return std::nullopt;
  const auto month = TakeDigits(text, 2);
  if (!month || !Take(text, "-")) return std::nullopt;
  const auto day = TakeDigits(text, 2);
  if (!day || *month < 1 || *month > 12 || *day < 1 || *day > 31) return std::nullopt;
  if (Take(text, "T ") && !ParseTimeOfDay(text, parts)) return std::nullopt;
  static_cast<void>(Take(text, "Z"));
  if (!text.empty()) return std::nullopt;
  parts.tm_year = *year - 1900;
  parts.tm_mon = *month - 1;
  parts.tm_mday = *day;
  const std::time_t seconds = timegm(&parts);
  if (parts.tm_mday != *day) return std::nullopt;  // 30 February
  return static_cast<std::int64_t>(seconds) * kSecondUs;
}

}  // namespace axlecast
