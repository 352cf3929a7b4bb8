#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>

#include "core/device/can.h"

namespace axlecast::canopen {

// The frames of CANopen (CiA 301 v4.2) that a client of an encoder needs. Numbers are little-endian (7.1.4).

inline constexpr std::uint8_t kMinNode = 1;
inline constexpr std::uint8_t kMaxNode = 127;

// Function codes of the pre-defined connection set (7.3.3, tables 39 and 40); the node's id is added to all but NMT
// and SYNC.
inline constexpr std::uint32_t kNmtId = 0x000;
inline constexpr std::uint32_t kSyncId = 0x080;
inline constexpr std::uint32_t kEmergencyId = 0x080;
inline constexpr std::uint32_t kTpdo1Id = 0x180;
inline constexpr std::uint32_t kSdoAnswerId = 0x580;
inline constexpr std::uint32_t kSdoRequestId = 0x600;
inline constexpr std::uint32_t kHeartbeatId = 0x700;

// ---- network management: 7.2.8 ----

enum class NmtCommand : std::uint8_t {
  kStart = 0x01,
  kStop = 0x02,
  kEnterPreOperational = 0x80,
  kResetNode = 0x81,
  kResetCommunication = 0x82,
};
[[nodiscard]] CanFrame NmtFrame(NmtCommand command, std::uint8_t node);

enum class NmtState : std::uint8_t { kBootUp = 0x00, kStopped = 0x04, kOperational = 0x05, kPreOperational = 0x7F };
// Parses the data of a heartbeat or boot-up message; nothing for other data. Bit 7 is the toggle bit of node guarding.
[[nodiscard]] std::optional<NmtState> ParseHeartbeat(Bytes data);
[[nodiscard]] const char* NmtStateName(NmtState state);  // snake_case

// Returns a SYNC without the counter of 7.2.5.3.1.
[[nodiscard]] inline CanFrame SyncFrame() { return {.id = kSyncId, .data = {}}; }

// ---- service data objects, expedited: 7.2.4.3 ----

inline constexpr std::size_t kSdoSize = 8;  // bytes of a frame

struct ObjectId {
  std::uint16_t index = 0;
  std::uint8_t sub = 0;
  friend constexpr bool operator==(const ObjectId&, const ObjectId&) = default;
};

// One transfer of a client. All objects that are written here have 32 bits.
struct SdoRequest {
  ObjectId object;
  std::optional<std::uint32_t> write = {};  // its new value; nothing to read it
};
[[nodiscard]] CanFrame RequestFrame(std::uint8_t node, const SdoRequest& request);
// Parses the data of a frame to a server; nothing if it is no expedited request.
[[nodiscard]] std::optional<SdoRequest> ParseRequest(Bytes data);

// Table 22.
enum class AbortCode : std::uint32_t {
  kTimedOut = 0x0504'0000,
  kBadLength = 0x0607'0010,
};
[[nodiscard]] CanFrame AbortFrame(std::uint8_t node, ObjectId object, AbortCode code);
// Returns the meaning of the code; "unknown abort code" for a code that is not in table 22.
[[nodiscard]] const char* AbortText(std::uint32_t code);

struct SdoAnswer {
  enum class Kind : std::uint8_t {
    kValue,      // upload, expedited
    kWritten,    // download confirmed
    kAborted,    // `value` is the abort code
    kSegmented,  // an upload longer than four bytes begins; `value` is its length, 0 if not given
    kMalformed,  // cannot be an answer to an expedited request
  };
  Kind kind = Kind::kMalformed;
  ObjectId object;
  std::uint32_t value = 0;
  std::uint8_t size = 0;  // kValue: bytes of the value
};
// Parses 8 bytes, as the standard requires. Fewer are accepted if they hold all announced data: some servers do not pad.
[[nodiscard]] SdoAnswer ParseAnswer(Bytes data);

// ---- emergency: 7.2.7 ----

struct Emergency {
  std::uint16_t code = 0;  // 00xx: no error any more
  std::uint8_t error_register = 0;
  std::array<std::uint8_t, 5> specific{};

  [[nodiscard]] bool IsReset() const { return code >> 8 == 0; }
};
[[nodiscard]] std::optional<Emergency> ParseEmergency(Bytes data);
// Returns the class of an error code, table 26: "voltage". Never null.
[[nodiscard]] const char* EmergencyClass(std::uint16_t code);
// Returns the bits of the error register (1001h, 7.5.2.2) that are set: "generic, voltage"; "none".
[[nodiscard]] std::string ErrorRegisterText(std::uint8_t error_register);

// Returns the little-endian number in `data` from `first` on.
[[nodiscard]] constexpr std::uint32_t LittleEndian(Bytes data, std::size_t first, std::size_t count) {
  std::uint32_t value = 0;
  for (std::size_t i = 0; i < count; ++i) value |= std::uint32_t{data[first + i]} << (8 * i);
  return value;
}

// The objects that the driver uses. CiA 301 7.5.2 (1000h to 1A00h), CiA 406 (6000h on).

inline constexpr ObjectId kDeviceType = {0x1000, 0};
inline constexpr ObjectId kErrorRegister = {0x1001, 0};
inline constexpr ObjectId kStoreAll = {0x1010, 1};
inline constexpr ObjectId kVendor = {0x1018, 1};
inline constexpr ObjectId kProduct = {0x1018, 2};
inline constexpr ObjectId kRevision = {0x1018, 3};
inline constexpr ObjectId kSerial = {0x1018, 4};
inline constexpr ObjectId kTpdoCobId = {0x1800, 1};
inline constexpr ObjectId kTpdoType = {0x1800, 2};
inline constexpr ObjectId kTpdoTimer = {0x1800, 5};  // ms
inline constexpr ObjectId kTpdoFirst = {0x1A00, 1};
inline constexpr ObjectId kTpdoSecond = {0x1A00, 2};

inline constexpr ObjectId kUnitsPerTurn = {0x6001, 0};
inline constexpr ObjectId kTotalRange = {0x6002, 0};
inline constexpr ObjectId kPreset = {0x6003, 0};
inline constexpr ObjectId kPosition = {0x6004, 0};
inline constexpr std::size_t kPositionSize = 4;  // bytes
inline constexpr ObjectId kOperatingStatus = {0x6500, 0};
inline constexpr ObjectId kPhysicalSteps = {0x6501, 0};  // a turn
inline constexpr ObjectId kPhysicalTurns = {0x6502, 0};
inline constexpr ObjectId kAlarms = {0x6503, 0};
inline constexpr ObjectId kSupportedAlarms = {0x6504, 0};
inline constexpr ObjectId kWarnings = {0x6505, 0};
inline constexpr ObjectId kSupportedWarnings = {0x6506, 0};
inline constexpr ObjectId kOffset = {0x6509, 0};  // what a preset adds

// "profile number" in the lower half of 1000h.
inline constexpr std::uint32_t kEncoderProfile = 406;
// 6500h, as 6000h: bit 0, 1: counts rise counter-clockwise (Pepperl+Fuchs 9.5.69: "0 = CW Up, 1 = CCW Up"); bit 2:
// the scaling of 6001h and 6002h is on (TR-Electronic CEH 110, 10.12.1).
inline constexpr std::uint32_t kCounterClockwise = 0x1;
inline constexpr std::uint32_t kScalingOn = 0x4;
// Sub-index 1 of 1010h (CiA 301 7.5.2.13): the text "save" is written; bit 0 is read: the node saves on command.
inline constexpr std::uint32_t kSaveSignature = 0x65766173;
inline constexpr std::uint32_t kSavesOnCommand = 0x1;
// Sub-index 1 of 1800h: bit 31, the PDO does not exist; the lower 11 bits are its identifier (7.5.2.35).
inline constexpr std::uint32_t kPdoOff = 0x8000'0000;
inline constexpr std::uint32_t kPdoIdMask = 0x7FF;
// Entries of 1A00h: index, sub-index, length in bits (7.5.2.36).
inline constexpr std::uint32_t kMappedPosition = 0x6004'0020;
inline constexpr std::uint32_t kMappedAlarms = 0x6503'0010;
inline constexpr std::uint32_t kMaxCyclicSync = 240;  // of 1800h sub 2: 1 to 240, at each n-th SYNC

}  // namespace axlecast::canopen
