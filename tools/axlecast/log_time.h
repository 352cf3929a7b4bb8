#pragma once

#include <cstdint>
#include <optional>
#include <string_view>

namespace axlecast {

// A place in a log whose first event was received at `start` (us, UNIX time), as people write it: "12.5" or "12.5s",
// "15m", "2h" from its start; "2026-11-21T07:00:05.25" (UTC, as ParseUtc, with any part of a second). Nothing when it is
// none of these.
[[nodiscard]] std::optional<std::int64_t> ParseLogTime(std::string_view text, std::int64_t start);

// What to say of one that is none.
inline constexpr const char* kLogTimeForms =
    "write seconds from the log's start (12.5), 15m, 2h, or a time in UTC: 2026-11-21T07:00:05.25";

}  // namespace axlecast
