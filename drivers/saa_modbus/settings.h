#pragma once

#include <axlecast/alarm_entry_t.hpp>
#include <cstdint>
#include <memory>
#include <string>

#include "core/device/device.h"
#include "core/device/family.h"

namespace axlecast::saa_modbus {

// The family's keys of one device: README.md, "Configuration".
struct SaaModbusSettings final : DeviceSettings {
  int bits = 0;
  int registers = 1;  // requested in a live reading
  std::uint8_t address = 1;
  MonoNs timeout = 0;         // of an exchange; and the silence after one that failed
  MonoNs write_interval = 0;  // between two writes of the encoder's memory
};

// "The interval time between the beginning and the end of each frame is at least 3.5 bytes" (SAA manual 5.1.7).
// Above 19,200 Bd it stays 1.75 ms (Modbus over Serial Line V1.02, 2.5.1.1), in case the encoders hold to that.
[[nodiscard]] MonoNs SilentInterval(const LineFormat& line);
// Returns the duration of a read of two registers with its reply and the silent interval between them.
[[nodiscard]] MonoNs LongestExchange(const LineFormat& line);

// Returns the tolerance of a zero: what a shaft that stands still may show. "Set the current position to zero" states
// none.
[[nodiscard]] std::int64_t ZeroToleranceCounts(int bits);

// "counts 383, 8.4155 deg"
[[nodiscard]] std::string PositionText(std::int64_t counts, int bits);

[[nodiscard]] std::shared_ptr<const FamilyBus> ParseBus(ConfigMap& map, const BusConfig& bus);
[[nodiscard]] std::unique_ptr<DeviceSettings> ParseSettings(ConfigMap& device, const BusConfig& bus);
// Reports an error for every address that two devices share.
void CheckBus(ConfigMap& map, const BusConfig& bus);

inline constexpr std::size_t kMaxDevices = 32;  // on one bus: a unit load each of an RS-485 line

// The encoder reports no alarms. This one is raised while the driver follows the encoder to an address or a baud rate
// that differs from the file: after a restart the driver would not find it.
inline constexpr AlarmSpec kConfigurationDiffers = {
    0x200, alarm_entry_t::SOURCE_DRIVER, alarm_entry_t::SEVERITY_WARNING, "configuration_differs",
    "Change link.baud or address in the file to the encoder's, then restart"};

}  // namespace axlecast::saa_modbus
