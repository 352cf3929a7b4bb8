#pragma once

#include <bitset>
#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <string_view>
#include <vector>

#include "core/device/family.h"
#include "drivers/tformat/codec.h"

namespace axlecast::tformat {

// What the driver must know of an encoder on T-format.
struct Model {
  std::string_view name;  // as in the configuration
  Format format;
  std::uint8_t encoder_id = 0;  // ENID: names the model, not the unit
  double max_speed_rpm = 0;
  double max_accel_rad_s2 = 0;
};

// Every model but `custom`, whose bits and ENID come from the configuration.
[[nodiscard]] std::span<const Model> Models();
[[nodiscard]] const Model* FindModel(std::string_view name);

inline constexpr std::string_view kCustomModel = "custom";

// A stationary shaft is reset to 0 +- 0.35 degrees (TS5669 spec 9).
inline constexpr double kZeroToleranceDeg = 0.35;
[[nodiscard]] std::int64_t ZeroToleranceCounts(int single_turn_bits);

// Which readout the live slots use.
enum class Plan : std::uint8_t {
  kAll,         // ID 3 in every slot: position, turns and alarms of one instant
  kSingleTurn,  // ID 0, and ID 3 in every n-th slot: 31 us instead of 51 us on the wire
};

// Bytes in the user EEPROM that distinguish this unit from others of its model.
struct IdentityTag {
  std::uint8_t address = 0;
  std::vector<std::uint8_t> bytes;
};

// The family's keys of one device: README.md, "Configuration".
struct TFormatSettings final : DeviceSettings {
  Format format;
  std::uint8_t encoder_id = 0;
  bool battery = true;  // false: no backup battery, the multi-turn counter is not used
  Plan plan = Plan::kAll;
  int id3_every = 1;  // with Plan::kSingleTurn
  MonoNs timeout = 0;
  MonoNs silence = 0;
  std::optional<IdentityTag> identity;
  std::bitset<kEepromCells> eeprom_writable;
};

// The multi-turn counter is 0, or the adjacent turn while the shaft rests at the border between two turns.
[[nodiscard]] bool TurnsAreReset(const Reply& all, const TFormatSettings& settings);
// The single-turn position is 0 within the maker's 0.35 degrees.
[[nodiscard]] bool IsZero(const Reply& all, const TFormatSettings& settings);

[[nodiscard]] std::unique_ptr<TFormatSettings> ParseSettings(ConfigMap& device, const LineFormat& line);
// For Family::check_bus: a field of T-format is one character 8N1.
void CheckLine(ConfigMap& bus_map, const BusConfig& bus);

// The reply begins 3 us (typ.) after the request (TS5669 spec 7.1).
inline constexpr MonoNs kReplyDelay = 3 * kMicrosecond;

}  // namespace axlecast::tformat
