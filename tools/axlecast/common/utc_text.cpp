#include "tools/axlecast/common/utc_text.h"

#include <array>
#include <ctime>

#include "core/base/spelling.h"
#include "core/base/text.h"

namespace axlecast {
namespace {

constexpr std::int64_t kSecondUs = 1'000'000;

std::string Format(std::int64_t unix_us, const char* format) {
  const std::time_t seconds = unix_us / kSecondUs;
  std::tm parts{};
  std::array<char, 32> text{};
  if (gmtime_r(&seconds, &parts) == nullptr || std::strftime(text.data(), text.size(), format, &parts) == 0) {
    return "?";
  }
  return text.data();
}

}  // namespace

std::string UtcText(std::int64_t unix_us) { return Format(unix_us, "%Y-%m-%d %H:%M:%S"); }

std::string UtcMillisecondText(std::int64_t unix_us) {
  return UtcText(unix_us) + Text(".%03d", static_cast<int>(unix_us % kSecondUs / 1'000));
}

std::optional<std::int64_t> ParseUtc(std::string_view text, std::int64_t now) {
  if (const std::optional<MonoNs> age = ParseTime(text)) return now - *age / kMicrosecond;
  const std::string date(text.ends_with('Z') ? text.substr(0, text.size() - 1) : text);
  for (const char* format :
       {"%Y-%m-%d", "%Y-%m-%dT%H:%M", "%Y-%m-%d %H:%M", "%Y-%m-%dT%H:%M:%S", "%Y-%m-%d %H:%M:%S"}) {
    std::tm parts{};
    const char* end = strptime(date.c_str(), format, &parts);
    if (end == nullptr || *end != '\0') continue;
    const std::int64_t unix_us = static_cast<std::int64_t>(timegm(&parts)) * kSecondUs;
    if (Format(unix_us, format) == date) return unix_us;  // refuses 30 February and missing digits
  }
  return std::nullopt;
}

}  // namespace axlecast
