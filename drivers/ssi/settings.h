#pragma once

#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "core/config/machine_config.h"
#include "drivers/kit/clocked_line.h"
#include "drivers/ssi/codec.h"

namespace axlecast::ssi {

// The maker whose document defines the clock and the word.
enum class Maker : std::uint8_t {
  kSaa,     // Rongde Optics SAA series, manual 5.5
  kTwk,     // TWK, description of the SSI system
  kCustom,  // any other: defined in the file
};

// The family's keys of a bus: README.md, "Configuration".
struct SsiBus final : FamilyBus {
  ClockedLine line;
  MonoNs monoflop_max = 0;  // the pause between two transfers is longer
  ClockPlan plan;
  std::int64_t clock_hz = 0;  // 0: none fits, and the file is refused
};

// A status bit of the word.
struct StatusBit {
  std::string name;
  int place = 0;  // in the word, from 0
  bool active_high = true;
  bool is_error = true;  // the position is not valid while it is active; false: a warning
};
inline constexpr std::size_t kMaxStatusBits = 8;

// The family's keys of one device.
struct SsiSettings final : DeviceSettings {
  Format format;
  std::vector<StatusBit> status_bits;
  int parity_place = -1;  // in the word; -1: none
};

// For Family. Errors go into the map's list; never null.
[[nodiscard]] std::shared_ptr<const FamilyBus> ParseBus(ConfigMap& map, const BusConfig& bus);
[[nodiscard]] std::unique_ptr<DeviceSettings> ParseDevice(ConfigMap& device, const BusConfig& bus);

[[nodiscard]] const SsiBus& OwnBus(const BusConfig& bus);
[[nodiscard]] const SsiSettings& Own(const DeviceConfig& device);

[[nodiscard]] Maker MakerOf(std::string_view model);

}  // namespace axlecast::ssi
