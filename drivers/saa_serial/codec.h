#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>

#include "core/base/inline_bytes.h"
#include "core/device/reading.h"
#include "core/device/step.h"

// The SAA series over an asynchronous line as the maker's operation manual gives it: 5.1.1 to 5.1.6 (RS-485), 5.2
// and 5.3 (the same frames). Pure functions of bytes.
namespace axlecast::saa_serial {

inline constexpr std::uint8_t kFrameStart = 0xFF;   // 1st byte of every data frame
inline constexpr std::uint8_t kFixedHeader = 0x81;  // its 2nd byte, in the tables (2) of 5.1.1 to 5.3.4
inline constexpr std::uint8_t kRequestStart = 0xBC;
inline constexpr std::uint8_t kRequestMark = 0xAA;
inline constexpr std::uint8_t kControlCommand = 0xB0;  // BX: send the position (5.1.5 (1))
inline constexpr std::uint8_t kZeroCommand = 0xC0;     // CX: clear to zero (5.1.6 (1))

inline constexpr int kMinBits = 10;  // 4.1
inline constexpr int kMaxBits = 26;
inline constexpr std::size_t kRequestSize = 3;
inline constexpr std::size_t kLongestReply = 7;

// Two data bytes up to 16 bits, three up to 24, four above (tables (2)).
[[nodiscard]] constexpr std::size_t DataBytes(int bits) { return bits <= 16 ? 2 : bits <= 24 ? 3 : 4; }
[[nodiscard]] constexpr std::size_t ReplySize(int bits) { return 2 + DataBytes(bits) + 1; }

// The low eight bits of the sum of all bytes given.
[[nodiscard]] std::uint8_t Checksum(Bytes bytes);

// The accepted second byte of a reply. In bus mode, the text of 5.1.5 (1) defines the address, the table 81H.
enum class ReplyHeader : std::uint8_t { kEither, kAddress, kFixed };

// What a reply is checked against.
struct Format {
  int bits = 14;
  ReplyHeader header = ReplyHeader::kFixed;
  std::uint8_t address = 0;  // BX; of no matter with kFixed
};

enum class ReplyError : std::uint8_t {
  kNone,
  kShort,
  kLong,
  kStart,     // the first byte is not FF
  kChecksum,  // judged before the second byte
  kHeader,    // the second byte is no header allowed: another encoder's address, perhaps
  kRange,     // bits above the resolution are set
};

struct Reply {
  ReplyError error = ReplyError::kNone;
  std::uint8_t header = 0;
  std::uint32_t counts = 0;  // [0, 2^bits) without an error
};
[[nodiscard]] Reply ParseReply(Bytes bytes, const Format& format);

// BC AA and the command byte.
[[nodiscard]] Frame Request(std::uint8_t command);
// The command byte of a request; nothing when the bytes are none.
[[nodiscard]] std::optional<std::uint8_t> ParseRequest(Bytes bytes);

// ---- one exchange ----

// The result of one exchange, or of one place in the stream.
struct Reading {
  std::optional<ErrorKind> error;  // nothing: a position
  std::uint32_t counts = 0;
  Interval at;  // of a position: holds the sampling instant; else of the bytes
};

// The reply to a request for a position, or to a pulse on CLK: a function of the event alone. Bytes before the frame's FF
// are skipped: a line that changes its direction may produce them.
struct PolledReading {
  Reading reading;
  std::size_t stray = 0;  // bytes before the frame
};
[[nodiscard]] PolledReading ReadReply(const Event& event, const Format& format, MonoNs character);

// Length of the reply of an encoder of `bits`: its frame begins with the first FF that no other FF follows.
[[nodiscard]] ReplyLength LengthRule(int bits);
// Where that frame begins.
[[nodiscard]] std::size_t BeginOfReply(Bytes so_far);
// Returns what distinguishes the encoder's replies from others on its bus: its address, if the reply must contain it.
[[nodiscard]] ReplyShape ShapeOf(const Format& format);

}  // namespace axlecast::saa_serial
