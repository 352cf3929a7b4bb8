#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>

#include "core/base/time.h"

namespace axlecast {

// "90s", "15m", "1.5h", "14d", "2w", "5y" (of 365.25 days): at most 200 years.
[[nodiscard]] std::optional<MonoNs> ParseTime(std::string_view text);
// The same back.
[[nodiscard]] std::string FormatTime(MonoNs time);
inline constexpr const char* kTimeRule = "a time: 90s, 15m, 1h, 14d, 2w or 5y";

// Bytes: "512kB", "100MB", "20GB", "1TB"; k = 1024. At most 1 PB.
[[nodiscard]] std::optional<std::int64_t> ParseSize(std::string_view text);
[[nodiscard]] std::string FormatSize(std::int64_t bytes);
inline constexpr const char* kSizeRule = "a size: 512kB, 100MB, 20GB or 1TB";

}  // namespace axlecast
