#include "tools/axlecast/logs/log_time.h"

#include <charconv>
#include <cmath>
#include <limits>
#include <utility>

#include "tools/axlecast/common/utc_text.h"

namespace axlecast {
namespace {

constexpr double kSecondUs = 1e6;
constexpr double kLongest = 4e9;  // s: beyond any log

double UnitSeconds(char unit) {
  switch (unit) {
    case 's':
      return 1;
    case 'm':
      return 60;
    case 'h':
      return 3'600;
    case 'd':
      return 86'400;
    default:
      return 0;
  }
}

std::optional<std::int64_t> ParseSeconds(std::string_view text) {
  double seconds = 0;
  const char* const end = text.data() + text.size();
  const auto [rest, error] = std::from_chars(text.data(), end, seconds, std::chars_format::fixed);
  if (error != std::errc() || end - rest > 1) return std::nullopt;
  if (rest != end) seconds *= UnitSeconds(*rest) > 0 ? UnitSeconds(*rest) : std::numeric_limits<double>::infinity();
  if (std::signbit(seconds) || !(seconds <= kLongest)) return std::nullopt;
  return static_cast<std::int64_t>(std::llround(seconds * kSecondUs));
}

// us of ".25" or ".25Z"; what stands before it goes to `before`.
std::optional<std::int64_t> TakeFraction(std::string_view text, std::string_view& before) {
  const std::size_t point = text.find('.');
  before = text.substr(0, point);
  if (point == std::string_view::npos) return 0;
  std::string_view digits = text.substr(point + 1);
  if (digits.ends_with('Z')) digits.remove_suffix(1);
  if (digits.empty() || digits.find_first_not_of("0123456789") != std::string_view::npos) return std::nullopt;
  std::int64_t us = 0;
  for (std::size_t i = 0; i < 6; ++i) us = us * 10 + (i < digits.size() ? digits[i] - '0' : 0);
  return us;
}

}  // namespace

std::optional<std::int64_t> ParseLogTime(std::string_view text, const LogSpan& span) {
  if (text.starts_with('-')) {
    const auto before = ParseSeconds(text.substr(1));
    return before ? std::optional(span.last - *before) : std::nullopt;
  }
  if (const auto since = ParseSeconds(text)) return span.first + *since;
  std::string_view whole;
  const auto fraction = TakeFraction(text, whole);
  if (!fraction || whole.find('-') == std::string_view::npos) return std::nullopt;
  const auto seconds = ParseUtc(whole, 0);
  return seconds ? std::optional(*seconds + *fraction) : std::nullopt;
}

void LogTimeOptions::AddTo(CLI::App& command) {
  command
      .add_option("--from", from_text_,
                  "From then on: 12.5 (s), 15m, 2h from the start; -10 before the end; 2026-11-21T07:00 (UTC)")
      ->type_name("T");
  command.add_option("--until", until_text_, "Before then")->type_name("T");
}

std::string LogTimeOptions::Understand(const std::vector<Bytes>& logs) {
  if (from_text_.empty() && until_text_.empty()) return "";
  const LogSpan span = SpanOf(logs);
  for (const auto& [text, time] : {std::pair(&from_text_, &from_), {&until_text_, &until_}}) {
    if (text->empty()) continue;
    *time = ParseLogTime(*text, span);
    if (!*time) {
      return "'" + *text +
             "' is no time: write 12.5, 90s, 15m or 2h (from the log's first message), -10 (before its last one) "
             "or "
             "2026-11-21T07:00:05.25 (UTC)";
    }
  }
  return !from_ || !until_ || *from_ < *until_ ? "" : "--from is not before --until: nothing stands between";
}

}  // namespace axlecast
