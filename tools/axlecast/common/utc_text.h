#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>

namespace axlecast {

// Times of day, as people write them; always UTC.

// "2026-11-21 07:00:05" of us, UNIX time; "?" when the calendar ends before it.
[[nodiscard]] std::string UtcText(std::int64_t utime);
// The same with milliseconds: "2026-11-21 07:00:05.123".
[[nodiscard]] std::string UtcMillisecondText(std::int64_t utime);

// us, UNIX time, of "90s", "15m", "2h", "3d" or "2w" before `now`; of "2026-11-21", "2026-11-21T07:00",
// "2026-11-21 07:00:05", each with or without a Z at its end. Nothing when it is none of these.
[[nodiscard]] std::optional<std::int64_t> ParseUtc(std::string_view text, std::int64_t now);

}  // namespace axlecast
