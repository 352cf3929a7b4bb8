#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>

namespace axlecast {

// Times in UTC as text.

// Returns the time in a format of strftime, or "?" if the calendar does not reach so far. `unix_us`: UNIX time in us.
[[nodiscard]] std::string FormatUtc(std::int64_t unix_us, const char* format);
// Parses a text that FormatUtc returns for a format of whole seconds, and no other text. Returns UNIX time in us.
[[nodiscard]] std::optional<std::int64_t> ParseUtcAs(const std::string& text, const char* format);

// "2026-11-21 07:00:05", or "?" if the calendar does not reach so far.
[[nodiscard]] std::string UtcText(std::int64_t unix_us);
// "2026-11-21 07:00:05.123"
[[nodiscard]] std::string UtcMillisecondText(std::int64_t unix_us);

// Parses a time before `now`, as ParseTime does ("90s", "15m", "2h"), or "2026-11-21", "2026-11-21T07:00" or
// "2026-11-21 07:00:05", with or without a Z at the end. Returns UNIX time in us, or nothing if the text has another form.
[[nodiscard]] std::optional<std::int64_t> ParseUtc(std::string_view text, std::int64_t now);

}  // namespace axlecast
