#pragma once

#include <concepts>
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
inline constexpr std::size_t kSmallestEvent = kEventHeader + 1;  // a channel's name has at least one byte
inline constexpr std::size_t kLongestLogChannel = 255;           // LCM sends at most 63; stock readers refuse 1,000
inline constexpr std::size_t kLargestLogData = 64U << 20;        // bytes; a greater length counts as damage

// Appends the record of the event. Its channel and data must not exceed the lengths above.
void AppendEvent(std::vector<std::uint8_t>& log, const LogEvent& event);

// Returns the size of the event's record in bytes.
[[nodiscard]] std::size_t EventSize(const LogEvent& event);

// Returns the event whose record begins at the start of `log`; its views refer to `log`. Returns nothing if no complete,
// plausible record begins there. A channel with a NUL byte is not plausible.
[[nodiscard]] std::optional<LogEvent> ParseEvent(Bytes log);

// Header events: axlecast's recorder writes them first into every file, so that a log can be read without other files.
inline constexpr std::string_view kMachineChannel = "AXLECAST/machine.yaml";  // the text of the machine's file
// All of lcmtypes/*.lcm as one text, in the order of their names.
inline constexpr std::string_view kSchemaChannel = "AXLECAST/schema";
// JSON: version, host, URLs, start, the file's number.
inline constexpr std::string_view kRecorderChannel = "AXLECAST/recorder";

// Returns true for the channels of axlecast's own events in a log: header events and seals (log_seal.h).
[[nodiscard]] bool IsLogChannel(std::string_view channel);

// Integers in the byte order of LCM.
template <std::unsigned_integral Value>
void AppendBigEndian(std::vector<std::uint8_t>& bytes, Value value) {
  for (std::size_t shift = sizeof(Value) * 8; shift > 0;) {
    shift -= 8;
    bytes.push_back(static_cast<std::uint8_t>(value >> shift));
  }
}

// Reads the integer at `offset`. `bytes` must contain all its bytes.
template <std::unsigned_integral Value>
[[nodiscard]] Value ReadBigEndian(Bytes bytes, std::size_t offset) {
  Value value = 0;
  for (std::size_t i = 0; i < sizeof(Value); ++i) value = static_cast<Value>(value << 8U | bytes[offset + i]);
  return value;
}

}  // namespace axlecast
