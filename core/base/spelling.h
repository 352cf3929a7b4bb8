#pragma once

#include <algorithm>
#include <array>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "core/base/time.h"

namespace axlecast {

// Returns the word of `known` that `word` is probably meant to be; nothing if no known word is similar.
[[nodiscard]] std::optional<std::string> NearestWord(std::string_view word, const std::vector<std::string>& known);
// Returns "; did you mean 'b'?" if a known word is similar, else `otherwise`.
[[nodiscard]] std::string Suggestion(std::string_view word, const std::vector<std::string>& known,
                                     const std::string& otherwise);

// Returns "a, b, c".
[[nodiscard]] std::string Listed(const std::vector<std::string>& words);

// Returns a value of the file as an error message shows it: in quotes, shortened, control characters made visible.
[[nodiscard]] std::string Quoted(std::string_view value);

// Parses a whole decimal number from `min` to `max` without any other character.
[[nodiscard]] std::optional<std::int64_t> ParseInteger(std::string_view text, std::int64_t min = INT64_MIN,
                                                       std::int64_t max = INT64_MAX);

// Returns true for a name of a machine, bus, device, password, key or log.
[[nodiscard]] bool IsName(std::string_view text);
inline constexpr const char* kNameRule = " is no name: 1 to 24 of a-z, 0-9, _ and -";

// Parses and formats "90s", "15m", "1.5h", "14d", "2w", "5y" (of 365.25 days): at most 200 years.
[[nodiscard]] std::optional<MonoNs> ParseTime(std::string_view text);
[[nodiscard]] std::string FormatTime(MonoNs time);
inline constexpr const char* kTimeRule = "a time: 90s, 15m, 1h, 14d, 2w or 5y";

// Parse and format bytes: "512kB", "100MB", "20GB", "1TB"; k = 1024. At most 1 PB.
[[nodiscard]] std::optional<std::int64_t> ParseSize(std::string_view text);
[[nodiscard]] std::string FormatSize(std::int64_t bytes);
inline constexpr const char* kSizeRule = "a size: 512kB, 100MB, 20GB or 1TB";

// alarm_entry_t SEVERITY_* as words, in their order.
inline constexpr std::array<std::string_view, 4> kSeverityNames = {"info", "warning", "error", "critical"};

// Above every severity.
inline constexpr std::uint8_t kNoSeverity = kSeverityNames.size();

[[nodiscard]] inline std::optional<std::uint8_t> ParseSeverity(std::string_view word) {
  const auto* const found = std::find(kSeverityNames.begin(), kSeverityNames.end(), word);
  if (found == kSeverityNames.end()) return std::nullopt;
  return static_cast<std::uint8_t>(found - kSeverityNames.begin());
}

}  // namespace axlecast
