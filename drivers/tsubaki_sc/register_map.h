#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <string_view>

#include "core/base/inline_bytes.h"
#include "core/device/parameter.h"
#include "drivers/protocol/modbus/adu.h"

namespace axlecast::tsubaki_sc {

// The unit's data addresses ("SC unit communication guidelines", 7). Gaps between blocks answer error 02, so a
// request never spans two blocks.

// One request's worth of consecutive addresses, with the function that reads it.
struct Block {
  modbus::Function read{};
  std::uint16_t first = 0;
  std::uint16_t count = 0;

  [[nodiscard]] constexpr std::uint32_t end() const { return std::uint32_t{first} + count; }
  [[nodiscard]] constexpr bool Holds(const Block& data) const {
    return data.read == read && data.count > 0 && data.first >= first && data.end() <= end();
  }
  friend constexpr bool operator==(const Block&, const Block&) = default;
};

// Coils: guideline 8.
inline constexpr std::uint16_t kClearTripCountCoil = 0;
inline constexpr std::uint16_t kStopCoilAddress = 100;
inline constexpr std::uint16_t kStartCoil = 200;
inline constexpr Block kStopCoil = {modbus::Function::kReadCoils, kStopCoilAddress, 1};
// Input status: guideline 9. Off 50 Hz, on 60 Hz.
inline constexpr Block kMains = {modbus::Function::kReadDiscreteInputs, 0, 1};
// Input registers: guideline 10.
inline constexpr Block kSetValues = {modbus::Function::kReadInputRegisters, 0, 9};
inline constexpr Block kAnalog = {modbus::Function::kReadInputRegisters, 100, 7};
inline constexpr Block kStatus = {modbus::Function::kReadInputRegisters, 200, 5};
inline constexpr Block kLoginStatus = {modbus::Function::kReadInputRegisters, 300, 1};
// Holding registers: guideline 11. The last four are read and written whole only.
inline constexpr std::uint16_t kOverheatLimitAddress = 52;
inline constexpr std::uint16_t kShockLimitAddress = 53;
inline constexpr std::uint16_t kLogIntervalAddress = 54;
inline constexpr Block kLogInterval = {modbus::Function::kReadHoldingRegisters, kLogIntervalAddress, 1};
inline constexpr Block kLoginBlock = {modbus::Function::kReadHoldingRegisters, 100, 8};
inline constexpr Block kPassword = {modbus::Function::kReadHoldingRegisters, 200, 8};
inline constexpr Block kProductCode = {modbus::Function::kReadHoldingRegisters, 300, 2};
inline constexpr Block kMfgNumber = {modbus::Function::kReadHoldingRegisters, 350, 5};
// The parameters 0 to 54 in three requests. How many registers one request may ask for is not documented; a log
// has 20, so that many are allowed.
inline constexpr std::array<Block, 3> kParameterBlocks = {{{modbus::Function::kReadHoldingRegisters, 0, 19},
                                                           {modbus::Function::kReadHoldingRegisters, 19, 18},
                                                           {modbus::Function::kReadHoldingRegisters, 37, 18}}};
// Slave information: guideline 12. It has no address.
inline constexpr Block kVersion = {modbus::Function::kReportServerId, 0, 0};

// AI 300: guideline 10.
inline constexpr std::uint16_t kSaysLoggedOut = 0x0000;
inline constexpr std::uint16_t kSaysLoggedIn = 0xFF00;

// Error codes: guideline 5.
inline constexpr std::uint8_t kLoginError = 0x04;
[[nodiscard]] const char* ExceptionName(std::uint8_t code);

// The 55 settings of guideline 11, in the order of their addresses 0 to 54.
[[nodiscard]] std::span<const ParameterSpec> Parameters();
// Returns null if no parameter has this name.
[[nodiscard]] const ParameterSpec* FindParameter(std::string_view name);

// A measured quantity, live (from kAnalog on) and in the trip logs, in this order: guideline 10.
struct Quantity {
  std::string_view key;  // with its unit, as in motor_health_t
  double divisor;        // registers per unit
  bool is_signed;
};
inline constexpr std::size_t kQuantities = 7;
inline constexpr std::array<Quantity, kQuantities> kQuantityTable = {{
    {"voltage_v", 10, false},
    {"current_a", 1000, false},  // registers in mA
    {"power_w", 10, false},
    {"temperature_c", 10, true},
    {"accel_x_mps2", 100, true},
    {"accel_y_mps2", 100, true},
    {"accel_z_mps2", 100, true},
}};
[[nodiscard]] constexpr double ToUnits(const Quantity& quantity, std::uint16_t raw) {
  return (quantity.is_signed ? static_cast<std::int16_t>(raw) : int{raw}) / quantity.divisor;
}

// Trip logs: 1000-1019 is the voltage of log 1, 3600-3619 the acceleration Z of log 3.
inline constexpr std::size_t kLogs = 3;
inline constexpr std::uint16_t kLogSamples = 20;
[[nodiscard]] constexpr Block LogBlock(std::size_t log, std::size_t quantity) {
  return {modbus::Function::kReadInputRegisters, static_cast<std::uint16_t>(1000 * (log + 1) + 100 * quantity),
          kLogSamples};
}
struct LogPlace {
  std::size_t log = 0;       // 0 newest
  std::size_t quantity = 0;  // index into kQuantityTable
};
// Returns the log that holds these data, or nothing if no log holds all of them.
[[nodiscard]] std::optional<LogPlace> LogHolding(const Block& data);
// Returns the log that a block is, or nothing if it is no whole log.
[[nodiscard]] inline std::optional<LogPlace> LogPlaceOf(const Block& block) {
  return block.count == kLogSamples ? LogHolding(block) : std::nullopt;
}

// Returns the block that a request reads, or nothing for another request.
[[nodiscard]] std::optional<Block> BlockOf(Bytes request);

// Which half of a register holds the first of its two characters. The guideline only has "Endian: LSB".
enum class CharacterOrder : std::uint8_t { kHighFirst, kLowFirst };

// Returns the characters of registers without the NULs and blanks at the end. Other bytes than printable ASCII become '?'.
[[nodiscard]] std::string RegisterText(Bytes registers, CharacterOrder order);

// The two bytes of kVersion: 01 00 is "Ver.1.0.0" (guideline 12), so the lower one holds two digits.
[[nodiscard]] std::string VersionText(Bytes version);

// How a password is encoded in its eight registers.
struct PasswordFormat {
  CharacterOrder order = CharacterOrder::kHighFirst;
  std::uint8_t padding = 0x00;  // NUL, or a space 0x20: guideline 11
};

// 8 to 16 characters of '!' (0x21) to '~' (0x7E): guideline 11. The text prints the last as "-(0x7E)".
[[nodiscard]] bool IsPassword(std::string_view text);

// Function 16 on `block` (kLoginBlock or kPassword). `text` must be a password. The caller must wipe the frame.
[[nodiscard]] Frame WritePassword(std::uint8_t address, const Block& block, std::string_view text,
                                  const PasswordFormat& format);

// Registers 200-207 as they were read hold that password, padded with NULs (guideline 11) or as it was written.
[[nodiscard]] bool HoldsPassword(Bytes registers, std::string_view text, CharacterOrder order);

void Wipe(Frame& frame);

}  // namespace axlecast::tsubaki_sc
