#pragma once

#include <cstdint>

namespace axlecast::tsubaki_sc::simulator {

// The data address list, guideline 7.
enum class Space : std::uint8_t { kCoil, kInputStatus, kInputRegister, kHoldingRegister };

inline constexpr std::uint16_t kCoilClearTripCount = 0;
inline constexpr std::uint16_t kCoilStop = 100;
inline constexpr std::uint16_t kCoilStart = 200;
inline constexpr std::uint16_t kParameters = 0;  // holding registers
inline constexpr std::uint16_t kParameterCount = 55;
inline constexpr std::uint16_t kOverheatLimit = 52;
inline constexpr std::uint16_t kExcessiveShockLimit = 53;
inline constexpr std::uint16_t kLogInterval = 54;
inline constexpr std::uint16_t kLoginLogout = 100;
inline constexpr std::uint16_t kPassword = 200;
inline constexpr std::uint16_t kProductCode = 300;
inline constexpr std::uint16_t kMfgNumber = 350;

struct Block {
  std::uint16_t first = 0;
  std::uint16_t last = 0;
  bool writable = false;
  bool whole = false;  // *1: only all of it at once

  [[nodiscard]] std::uint32_t size() const { return last - first + 1U; }
};
// The block that holds the address; null when the unit has no such address.
[[nodiscard]] const Block* BlockAt(Space space, std::uint16_t address);

// Lower and upper limit of a parameter, guideline 11.
struct Range {
  std::uint16_t low = 0;
  std::uint16_t high = 0;
};
[[nodiscard]] Range ParameterRange(std::uint16_t address);

}  // namespace axlecast::tsubaki_sc::simulator
