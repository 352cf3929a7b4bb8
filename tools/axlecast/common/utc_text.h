#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>

namespace axlecast {

// Formats a UNIX time in us in UTC: "2026-11-21 07:00:05", or "?" beyond the calendar.
[[nodiscard]] std::string UtcText(std::int64_t unix_us);
// "2026-11-21 07:00:05.123"
[[nodiscard]] std::string UtcMillisecondText(std::int64_t unix_us);

// Parses a time before `now` ("90s", "15m", "2h", see ParseTime), or "2026-11-21", "2026-11-21T07:00" or
// "2026-11-21 07:00:05", with or without a Z at the end. Returns UNIX time in us, or nothing if the text has another form.
[[nodiscard]] std::optional<std::int64_t> ParseUtc(std::string_view text, std::int64_t now);

}  // namespace axlecast
