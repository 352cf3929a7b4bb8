#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>

#include "core/device/can.h"

// The frames of the SAA series on CAN by the maker's operation manual, 5.4.1. The manual calls them CANopen, but they are a
// protocol of their own on 11-bit identifiers. Pure functions of frames.
namespace axlecast::saa_can {

inline constexpr int kMinBits = 10;  // 4.1
inline constexpr int kMaxBits = 26;

// The manual's NN. It has 8 bits, because the manual's example is node FF; a CANopen node has 7.
inline constexpr std::uint8_t kMinNode = 0x01;
inline constexpr std::uint8_t kMaxNode = 0xFF;
inline constexpr std::uint8_t kFactoryNode = 0x20;         // (2)
inline constexpr std::int64_t kFactoryBitrate = 250'000;   // (2)
inline constexpr std::int64_t kFactoryPeriodMs = 100;      // (2), nominal; the log in (1) shows 106.4 ms
inline constexpr std::uint32_t kDataBase = 0x100;          // 1NN: positions and replies of node NN
inline constexpr std::uint32_t kCommandBase = 0x200;       // 2NN: commands to node NN
inline constexpr std::uint32_t kNodeMask = 0x0FF;          // NN within either
inline constexpr std::uint32_t kConfigureId = 0x7E5;       // (2) note, (3) ②③
inline constexpr std::uint32_t kConfigureReplyId = 0x7E4;  // CiA 305 6.2; the manual prints replies on 7E5 too
inline constexpr std::size_t kSentSize = 8;                // "DLC are 8"

[[nodiscard]] constexpr std::uint32_t DataId(std::uint8_t node) { return kDataBase + node; }
[[nodiscard]] constexpr std::uint32_t RequestId(std::uint8_t node) { return kCommandBase + node; }

// ---- positions ----

struct Format {
  int bits = 14;
  bool big_endian = false;  // the manual's example is little-endian; it has none above 16 bits
};
// Returns the data bytes of a position. 5.4.1 prints two. Above 16 bits, as many as hold the position, as in 5.1.1.
[[nodiscard]] constexpr std::size_t DataBytes(int bits) { return bits <= 16 ? 2 : bits <= 24 ? 3 : 4; }

enum class PositionError : std::uint8_t {
  kNone,
  kShort,  // fewer bytes than the position has
  kRange,  // bits above the resolution are set
};
struct Position {
  PositionError error = PositionError::kNone;
  std::uint32_t counts = 0;  // [0, 2^bits) without an error
};
// Parses the data of a frame 1NN, 2 to 8 bytes. Bytes after the position are ignored.
[[nodiscard]] Position ParsePosition(Bytes data, const Format& format);

// ---- commands to one node: (3) ①, ④ to ⑧ ----

enum class Command : std::uint8_t {
  kStart = 0x01,      // ① "Start NN node"; answered by a position
  kRead = 0x80,       // ① "Jog No.NN encoder": one position
  kZero = 0x20,       // ⑥ titled "Setting NN Node": it sets zero in our interpretation
  kDirection = 0x22,  // ④ positive, ⑤ inverse: printed with the same bytes
  kPeriod = 0x31,     // ⑦ TT positions a second, ⑧ stop: printed with the same bytes
};
// `parameter` is D2: TT of ⑦, otherwise 0 as printed.
[[nodiscard]] CanFrame CommandFrame(Command command, std::uint8_t node, std::uint8_t parameter = 0);

struct Request {
  Command command = Command::kStart;
  std::uint8_t node = 0;  // of D1
  std::uint8_t parameter = 0;
};
// Parses the data of a frame 2NN; nothing for data that are no command of the manual.
[[nodiscard]] std::optional<Request> ParseRequest(Bytes data);

// The commands whose reply is their own code on 1NN, the identifier of positions.
inline constexpr std::array kAcknowledged = {Command::kZero, Command::kDirection, Command::kPeriod};
// Returns whether the data of a frame 1NN may be the reply to the command: its code, then 00 in the other bytes of a
// position with this many bits. The data are then a position too: 0x0020, 0x0022 or 0x0031, little-endian.
[[nodiscard]] bool MayAcknowledge(Bytes data, Command command, int bits);

// ---- the dialogue with every node at once: (3) ②③ ----

enum class Service : std::uint8_t {
  kMode = 0x04,     // 04 01 enters configuration mode, 04 00 leaves it (CiA 305 7.1.2). Not answered
  kNode = 0x11,     // ②
  kBitrate = 0x13,  // ③
};
[[nodiscard]] CanFrame ServiceFrame(Service service, std::uint8_t d1, std::uint8_t d2);
[[nodiscard]] CanFrame ModeFrame(bool configuration);
[[nodiscard]] CanFrame NodeFrame(std::uint8_t node);
[[nodiscard]] CanFrame BitrateFrame(std::uint8_t code);

// Returns whether the data of a sent frame 7E5 give the encoder another node id or bit rate.
[[nodiscard]] bool SetsParameter(Bytes data);

struct ServiceReply {
  Service service = Service::kNode;
  std::uint8_t result = 0;  // 00: success
};
// Parses the data of a frame 7E5 or 7E4; nothing if they are surely no reply.
[[nodiscard]] std::optional<ServiceReply> ParseServiceReply(Bytes data);

// Convert between bit rates and the codes of ③: 1M, 500K, 250K; nothing for other values.
[[nodiscard]] std::optional<std::uint8_t> BitrateCode(std::int64_t bitrate);
[[nodiscard]] std::optional<std::int64_t> BitrateOf(std::uint8_t code);

}  // namespace axlecast::saa_can
