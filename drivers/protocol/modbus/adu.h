#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>

#include "core/base/inline_bytes.h"
#include "core/device/reading.h"
#include "core/device/step.h"

namespace axlecast::modbus {

// Modbus RTU frames, both directions, free of I/O (Modbus over Serial Line V1.02, Application Protocol V1.1b3).
// An ADU is address, PDU, CRC with its low byte first.

enum class Function : std::uint8_t {
  kReadCoils = 0x01,
  kReadDiscreteInputs = 0x02,
  kReadHoldingRegisters = 0x03,
  kReadInputRegisters = 0x04,
  kWriteCoil = 0x05,
  kWriteRegister = 0x06,
  kWriteCoils = 0x0F,
  kWriteRegisters = 0x10,
  kReportServerId = 0x11,
};

inline constexpr std::uint8_t kBroadcast = 0;  // every device acts, none answers
inline constexpr std::uint16_t kCoilOn = 0xFF00;
inline constexpr std::uint16_t kCoilOff = 0x0000;

[[nodiscard]] std::uint16_t Crc16(Bytes bytes);
// Appends the CRC, low byte first.
[[nodiscard]] Frame Sealed(Frame frame);
// At least 4 bytes, of which the last two are the CRC of the others.
[[nodiscard]] bool IsSealed(Bytes adu);

// `function` is one of the four reads.
[[nodiscard]] Frame Read(std::uint8_t address, Function function, std::uint16_t start, std::uint16_t count);
[[nodiscard]] Frame WriteCoil(std::uint8_t address, std::uint16_t coil, bool on);
[[nodiscard]] Frame WriteRegister(std::uint8_t address, std::uint16_t start, std::uint16_t value);
// At most 123 values.
[[nodiscard]] Frame WriteRegisters(std::uint8_t address, std::uint16_t start,
                                   std::span<const std::uint16_t> values);

// Returns the length of the reply that begins so, by its function code: a ReplyLength of the standard functions. 0 while
// more bytes are needed. An unknown function or an impossible byte count has the length of an exception, so that a damaged
// reply ends at once.
[[nodiscard]] std::size_t ReplyLength(Bytes so_far);

// Returns whether `reply` is the reply to `request`, both of the standard functions: an axlecast::MatchReply. A reply with a
// wrong checksum is evaluated by MatchBegin.
[[nodiscard]] ReplyMatch MatchReply(Bytes request, Bytes reply);
// Evaluates the first bytes of a reply with a wrong checksum: kDamaged, kNearly with at most two inverted bits, or kNo.
[[nodiscard]] ReplyMatch MatchBegin(Bytes reply, std::array<std::uint8_t, 3> head);
// Returns what distinguishes the reply from others: address, function, and the part of the request that it repeats: number
// of registers or bits, first address of a write.
[[nodiscard]] ReplyShape ShapeOf(Bytes request);

// The reply to a request of the standard functions, checked in this order: too short, CRC, too long, address, exception,
// function, byte count (kRange) or echo. The byte count of Report Server ID is the device's own.
struct Reply {
  std::optional<ErrorKind> error = {};  // kShort, kChecksum, kWrongEcho, kException, kRange
  std::uint8_t exception = 0;           // with kException: the code
  Bytes data = {};                      // of a read: its bytes, without the byte count; lives as long as the ADU

  [[nodiscard]] bool ok() const { return !error.has_value(); }
  // Register `index` of a register read.
  [[nodiscard]] std::uint16_t Register(std::size_t index) const {
    return static_cast<std::uint16_t>((data[2 * index] << 8) | data[2 * index + 1]);
  }
  [[nodiscard]] bool Bit(std::size_t index) const { return ((data[index / 8] >> (index % 8)) & 1U) != 0; }
};
[[nodiscard]] Reply Check(Bytes request, Bytes reply);

}  // namespace axlecast::modbus
