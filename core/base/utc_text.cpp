#include "core/base/utc_text.h"

#include <array>
#include <cstdio>
#include <ctime>

#include "core/base/spelling.h"

namespace axlecast {
namespace {

constexpr std::int64_t kSecondUs = 1'000'000;

}  // namespace

std::string FormatUtc(std::int64_t unix_us, const char* format) {
  const std::time_t seconds = unix_us / kSecondUs;
  std::tm parts{};
  std::array<char, 40> text{};
  if (gmtime_r(&seconds, &parts) == nullptr || std::strftime(text.data(), text.size(), format, &parts) == 0) {
    return "?";
  }
  return text.data();
}

std::optional<std::int64_t> ParseUtcAs(const std::string& text, const char* format) {
  std::tm parts{};
  if (strptime(text.c_str(), format, &parts) == nullptr) return std::nullopt;
  const std::int64_t unix_us = static_cast<std::int64_t>(timegm(&parts)) * kSecondUs;
  // Refuses 30 February, missing digits and what follows.
  return FormatUtc(unix_us, format) == text ? std::optional(unix_us) : std::nullopt;
}

std::string UtcText(std::int64_t unix_us) { return FormatUtc(unix_us, "%Y-%m-%d %H:%M:%S"); }

std::string UtcMillisecondText(std::int64_t unix_us) {
  std::array<char, 8> text{};
  static_cast<void>(
      std::snprintf(text.data(), text.size(), ".%03d", static_cast<int>(unix_us % kSecondUs / 1'000)));
  return UtcText(unix_us) + text.data();
}

std::optional<std::int64_t> ParseUtc(std::string_view text, std::int64_t now) {
  if (const auto age = ParseTime(text)) return now - *age / kMicrosecond;
  const std::string date(text.ends_with('Z') ? text.substr(0, text.size() - 1) : text);
  for (const char* format :
       {"%Y-%m-%d", "%Y-%m-%dT%H:%M", "%Y-%m-%d %H:%M", "%Y-%m-%dT%H:%M:%S", "%Y-%m-%d %H:%M:%S"}) {
    if (const auto unix_us = ParseUtcAs(date, format)) return unix_us;
  }
  return std::nullopt;
}

}  // namespace axlecast
