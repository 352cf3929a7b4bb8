#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <string_view>
#include <vector>

#include "core/base/inline_bytes.h"

namespace axlecast {

// One event of an LCM event log, as LCM 1.3.1 writes it (eventlog.c, documentation "LCM Log File Format"): big-endian
// u32 sync, i64 number, i64 utime, u32 channel length, u32 data length, channel, data; no checksum, no index.
struct LogEvent {
  std::int64_t number = 0;  // of the event in its log, from 0
  std::int64_t utime = 0;   // us, UNIX time of its reception
  std::string_view channel;
  Bytes data;
};

inline constexpr std::uint32_t kEventSync = 0xEDA1DA01;
inline constexpr std::size_t kEventHeader = 28;                  // bytes before the channel
inline constexpr std::size_t kSmallestEvent = kEventHeader + 1;  // LCM has no channel without a name
inline constexpr std::size_t kLongestLogChannel = 255;  // LCM sends at most 63; stock readers refuse 1,000 and more
inline constexpr std::size_t kLargestLogData = 64U << 20;  // bytes; a longer length is taken for damage

// Appends the event's record. Its channel and data have lengths that ParseEvent takes.
void AppendEvent(std::vector<std::uint8_t>& log, const LogEvent& event);

// Bytes of the event's record.
[[nodiscard]] std::size_t EventSize(const LogEvent& event);

// The event whose record begins `log`; its views live in `log`. Nothing where no whole, plausible record begins there
// (a channel holds no NUL).
[[nodiscard]] std::optional<LogEvent> ParseEvent(Bytes log);

}  // namespace axlecast
