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

// The word of `known` that `word` is probably meant to be; nothing when none is near.
[[nodiscard]] std::optional<std::string> NearestWord(std::string_view word, const std::vector<std::string>& known);

// "a, b, c"
[[nodiscard]] std::string Listed(const std::vector<std::string>& words);

// A value of the file as an error message shows it: in quotes, shortened, control characters made visible.
[[nodiscard]] std::string Quoted(std::string_view value);

// Of machines, buses, devices, passwords, keys and logs.
[[nodiscard]] bool IsName(std::string_view text);
inline constexpr const char* kNameRule = " is no name: 1 to 24 of a-z, 0-9, _ and -";

// "90s", "15m", "1.5h", "14d", "2w", "5y" (of 365.25 days): at most 200 years.
[[nodiscard]] std::optional<MonoNs> ParseTime(std::string_view text);
// The same back.
[[nodiscard]] std::string FormatTime(MonoNs time);
inline constexpr const char* kTimeRule = "a time: 90s, 15m, 1h, 14d, 2w or 5y";

// Bytes: "512kB", "100MB", "20GB", "1TB"; k = 1024. At most 1 PB.
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
