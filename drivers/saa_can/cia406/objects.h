#pragma once

#include "drivers/saa_can/cia406/canopen.h"

// The objects that the driver knows. CiA 301 7.5.2 (1000h to 1A00h), CiA 406 (6000h on).
namespace axlecast::saa_can::cia406 {

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
// Sub-index 1 of 1010h: written, the text "save"; read, bit 0: it saves on command (CiA 301 7.5.2.13).
inline constexpr std::uint32_t kSaveSignature = 0x65766173;
inline constexpr std::uint32_t kSavesOnCommand = 0x1;
// Sub-index 1 of 1800h: bit 31, the PDO does not exist; the lower 11 bits are its identifier (7.5.2.35).
inline constexpr std::uint32_t kPdoOff = 0x8000'0000;
inline constexpr std::uint32_t kPdoIdMask = 0x7FF;
// Entries of 1A00h: index, sub-index, length in bits (7.5.2.36).
inline constexpr std::uint32_t kMappedPosition = 0x6004'0020;
inline constexpr std::uint32_t kMappedAlarms = 0x6503'0010;
inline constexpr std::uint32_t kMaxCyclicSync = 240;  // of 1800h sub 2: 1 to 240, at each n-th SYNC

}  // namespace axlecast::saa_can::cia406
