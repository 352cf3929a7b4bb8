#pragma once

#include <cstdint>
#include <memory>
#include <optional>

#include "core/config/machine_config.h"
#include "drivers/saa_serial/codec.h"

namespace axlecast::saa_serial {

// How the encoder is asked (SAA manual 5.1.1 to 5.1.6).
enum class Mode : std::uint8_t {
  kTiming,     // it sends by itself at its refresh rate
  kHandshake,  // it sends one frame for each falling edge on CLK
  kBus,        // it answers BC AA BX
};

// A CLK or CLR line beside the bus.
struct Line {
  std::uint8_t index = 0;  // into FamilyBus::lines
  MonoNs low = 0;          // of one pulse
};

// The family's keys of a bus: README.md, "Configuration".
struct SaaBus final : FamilyBus {
  Mode mode = Mode::kBus;
  std::optional<Line> clk;
  std::optional<Line> clr;
  bool zero_clearing = false;  // the variant that clears to zero: by CLR, or by BC AA CX in bus mode
  MonoNs refresh = 0;          // timing: period of the frames
};

// The family's keys of one device.
struct SaaSettings final : DeviceSettings {
  Format format;
  std::optional<std::uint8_t> zero_command;  // CX, in bus mode with zero clearing
  MonoNs timeout = 0;                        // beyond the time on the wire
  MonoNs silence = 0;
  MonoNs processing = 0;   // timing: longest time from sampling to the frame's first bit
  MonoNs latency = 0;      // timing: longest time that an adapter holds a byte back, but for a stall
  MonoNs zero_settle = 0;  // from clearing to zero to a reading that shows it
};

// For Family. Errors go into the map's list; never null.
[[nodiscard]] std::shared_ptr<const FamilyBus> ParseBus(ConfigMap& map, const BusConfig& bus);
[[nodiscard]] std::unique_ptr<DeviceSettings> ParseDevice(ConfigMap& device, const BusConfig& bus);
// One device unless the bus is polled, and no two of one polled bus that answer to the same command.
void CheckBus(ConfigMap& map, const BusConfig& bus);

[[nodiscard]] const SaaBus& OwnBus(const BusConfig& bus);
[[nodiscard]] const SaaSettings& Own(const DeviceConfig& device);

// How near to 0 an encoder at rest must read after clearing to zero: 0.2 degrees, or two counts where these are more.
// The manual gives no tolerance; a shaft counts as at rest within 0.1 degrees.
inline constexpr double kZeroToleranceDeg = 0.2;
[[nodiscard]] std::int64_t ZeroToleranceCounts(int bits);

}  // namespace axlecast::saa_serial
