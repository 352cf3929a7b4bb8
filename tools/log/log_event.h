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

// LCM's log has no checksum. The recorder therefore writes seals as ordinary events on this channel, about once a second and at
// the end. Stock readers ignore them. A seal contains the size, the number and the CRC-32C (RFC 3720, appendix B.4) of the
// records since the previous seal, or since the start of the log.
inline constexpr std::string_view kSealChannel = "AXLECAST/seal";

struct LogSeal {
  std::uint64_t bytes = 0;   // of records since the previous seal, without seals
  std::uint64_t events = 0;  // number of these records
  std::uint32_t crc32c = 0;  // of these bytes
  bool operator==(const LogSeal&) const = default;
};

// Encodes the data of a seal's event: 20 bytes, big-endian, in the order of the fields.
[[nodiscard]] std::vector<std::uint8_t> EncodeSeal(const LogSeal& seal);
[[nodiscard]] std::optional<LogSeal> ParseSeal(Bytes data);

// Returns the CRC-32C of `data`, continued from `crc` (0 at the start).
[[nodiscard]] std::uint32_t Crc32c(std::uint32_t crc, Bytes data);

// Calculates the next seal from the records since the last one, while they are written or read.
class SealCount {
 public:
  // `record`: a complete record that is not a seal.
  void Add(Bytes record);
  [[nodiscard]] const LogSeal& seal() const { return seal_; }
  void Reset() { seal_ = {}; }  // after a seal

 private:
  LogSeal seal_;
};

// Encodes the records of one log: numbers its events and seals them.
class LogEncoder {
 public:
  LogEncoder() = default;
  // Continues a log of `bytes` bytes. `open`: its events after the last seal.
  LogEncoder(std::int64_t next_number, std::uint64_t bytes, const SealCount& open)
      : number_(next_number), bytes_(bytes), open_(open) {}

  // Returns the record of the event, with the next number in place of its own. It is valid until the next call.
  [[nodiscard]] Bytes Add(const LogEvent& event);
  // Returns the record of a seal over the events since the previous one, or no bytes if there were none.
  [[nodiscard]] Bytes Seal(std::int64_t utime);

  [[nodiscard]] std::uint64_t bytes() const { return bytes_; }
  [[nodiscard]] std::uint64_t unsealed_bytes() const { return open_.seal().bytes; }

 private:
  std::int64_t number_ = 0;  // of the next event
  std::uint64_t bytes_ = 0;
  SealCount open_;
  std::vector<std::uint8_t> record_;
};

// Returns true for the channels of axlecast's own events in a log: header events and seals.
[[nodiscard]] bool IsLogChannel(std::string_view channel);

// Return the same bytes in the other form, without a copy.
[[nodiscard]] inline std::string_view AsText(Bytes bytes) {
  return {reinterpret_cast<const char*>(bytes.data()), bytes.size()};
}
[[nodiscard]] inline Bytes AsBytes(std::string_view text) {
  return {reinterpret_cast<const std::uint8_t*>(text.data()), text.size()};
}

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
