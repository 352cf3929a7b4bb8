#include "platform/db/value_text.h"

#include <array>
#include <charconv>
#include <cmath>
#include <system_error>

#include "core/base/text.h"
#include "core/base/utc_text.h"

namespace axlecast::db {
namespace {

constexpr std::int64_t kUsPerSecond = 1'000'000;
constexpr std::int64_t kYear1000 = -30'610'224'000 * kUsPerSecond;   // 1000-01-01
constexpr std::int64_t kYear10000 = 253'402'300'800 * kUsPerSecond;  // 10000-01-01
constexpr const char* kSecondsFormat = "%Y-%m-%d %H:%M:%S";

// Takes `digits` decimal digits from the front of the text.
std::optional<int> TakeNumber(std::string_view& text, std::size_t digits) {
  if (text.size() < digits) return std::nullopt;
  int number = 0;
  const char* const end = text.data() + digits;
  const auto [rest, error] = std::from_chars(text.data(), end, number);
  if (error != std::errc() || rest != end || number < 0) return std::nullopt;
  text.remove_prefix(digits);
  return number;
}

bool Take(std::string_view& text, char character) {
  if (!text.starts_with(character)) return false;
  text.remove_prefix(1);
  return true;
}

// Takes "MM:SS"'s or "HH:MM:SS"'s next part after its colon; 0 without one.
std::optional<int> TakeOptionalPart(std::string_view& text) { return Take(text, ':') ? TakeNumber(text, 2) : 0; }

std::optional<std::int64_t> TakeFraction(std::string_view& text) {
  if (!Take(text, '.')) return 0;
  std::int64_t us = 0;
  std::int64_t place = kUsPerSecond / 10;
  std::size_t digits = 0;
  for (; digits < text.size() && text[digits] >= '0' && text[digits] <= '9'; ++digits, place /= 10) {
    us += place * (text[digits] - '0');
  }
  if (digits == 0 || digits > 6) return std::nullopt;
  text.remove_prefix(digits);
  return us;
}

// Takes "+00", "-03:30" or "+00:19:32". Returns seconds.
std::optional<int> TakeOffset(std::string_view& text) {
  const bool west = text.starts_with('-');
  if (!west && !text.starts_with('+')) return std::nullopt;
  text.remove_prefix(1);
  const auto hours = TakeNumber(text, 2);
  const auto minutes = TakeOptionalPart(text);
  const auto seconds = TakeOptionalPart(text);
  if (!hours || !minutes || !seconds) return std::nullopt;
  const int offset = *hours * 3600 + *minutes * 60 + *seconds;
  return west ? -offset : offset;
}

int HexDigit(char digit) {
  if (digit >= '0' && digit <= '9') return digit - '0';
  if (digit >= 'a' && digit <= 'f') return digit - 'a' + 10;
  return -1;
}

}  // namespace

std::optional<std::int64_t> ParseDatabaseTime(std::string_view text) {
  constexpr std::size_t kWholeSeconds = 19;  // "2026-11-27 10:49:47"
  const auto seconds = ParseUtcAs(std::string(text.substr(0, kWholeSeconds)), kSecondsFormat);
  if (!seconds) return std::nullopt;
  text.remove_prefix(kWholeSeconds);
  const auto fraction = TakeFraction(text);
  const auto offset = TakeOffset(text);
  if (!fraction || !offset || !text.empty()) return std::nullopt;
  return *seconds + *fraction - *offset * kUsPerSecond;
}

std::string DatabaseTimeText(std::int64_t unix_us) {
  if (unix_us < kYear1000) return "-infinity";
  if (unix_us >= kYear10000) return "infinity";
  std::int64_t fraction = unix_us % kUsPerSecond;
  if (fraction < 0) fraction += kUsPerSecond;
  return FormatUtc(unix_us - fraction, kSecondsFormat) + Text(".%06d+00", static_cast<int>(fraction));
}

std::optional<std::string> ParseBytea(std::string_view text) {
  if (!text.starts_with("\\x") || text.size() % 2 != 0) return std::nullopt;
  text.remove_prefix(2);
  std::string bytes;
  bytes.reserve(text.size() / 2);
  for (std::size_t i = 0; i < text.size(); i += 2) {
    const int high = HexDigit(text[i]);
    const int low = HexDigit(text[i + 1]);
    if (high < 0 || low < 0) return std::nullopt;
    bytes.push_back(static_cast<char>(high * 16 + low));
  }
  return bytes;
}

std::string FloatText(double value) {
  if (std::isnan(value)) return "NaN";
  if (std::isinf(value)) return value < 0 ? "-Infinity" : "Infinity";
  std::array<char, 32> text{};  // 24 characters at most
  return {text.data(), std::to_chars(text.begin(), text.end(), value).ptr};
}

std::string DatabaseText(std::string_view text) {
  std::string clean = MendedUtf8(text);
  for (std::size_t at = clean.find('\0'); at != std::string::npos; at = clean.find('\0', at))
    clean.replace(at, 1, "\uFFFD");
  return clean;
}

std::string JsonbText(std::string_view json) {
  std::string clean = MendedUtf8(json);
  for (std::size_t at = clean.find('\\'); at != std::string::npos; at = clean.find('\\', at + 2)) {
    if (clean.compare(at, 6, "\\u0000") == 0) clean.replace(at, 6, "\\ufffd");
  }
  return clean;
}

std::string QuotedElement(std::string_view text) {
  std::string quoted = "\"";
  for (const char character : DatabaseText(text)) {
    if (character == '"' || character == '\\') quoted += '\\';
    quoted += character;
  }
  return quoted + '"';
}

}  // namespace axlecast::db
