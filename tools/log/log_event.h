#pragma once

#include <concepts>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <string_view>
#include <vector>

#include "core/base/inline_bytes.h"

namespace axlecast {

// Numbers as LCM writes them.

template <std::unsigned_integral Value>
void AppendBigEndian(std::vector<std::uint8_t>& bytes, Value value) {
  for (std::size_t shift = sizeof(Value) * 8; shift > 0;) {
    shift -= 8;
    bytes.push_back(static_cast<std::uint8_t>(value >> shift));
  }
}

// The number that stands at `offset`; all its bytes are there.
template <std::unsigned_integral Value>
[[nodiscard]] Value ReadBigEndian(Bytes bytes, std::size_t offset) {
  Value value = 0;
  for (std::size_t i = 0; i < sizeof(Value); ++i) value = static_cast<Value>(value << 8U | bytes[offset + i]);
  return value;
}

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

// What a recorded log begins with, so that it can be read without anything else: events on these channels, before all
// others, in every file that a recording is split into.
inline constexpr std::string_view kMachineChannel = "AXLECAST/machine.yaml";  // the machine's file, as text
// All of lcmtypes/*.lcm as one text, files in order.
inline constexpr std::string_view kSchemaChannel = "AXLECAST/schema";
// JSON: version, host, URLs, start, the file's number.
inline constexpr std::string_view kRecorderChannel = "AXLECAST/recorder";

// True of the channels that axlecast's own logs hold beside what was heard: the above, and the seal.
[[nodiscard]] bool IsLogChannel(std::string_view channel);

}  // namespace axlecast
