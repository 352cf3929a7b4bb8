#pragma once

#include <axlecast/driver_device_t.hpp>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>

namespace axlecast {

// One device in a driver's HELLO: what the bridge keeps beyond the driver's life.
struct DeviceSummary {
  std::string device;
  std::int8_t state = 0;  // device_info_t STATE_*
  std::int32_t datum_epoch = 0;
  bool reference_lost = false;
  std::string identity = {};  // "17" or "17 SN0042"; empty unknown
  struct Datum {
    std::int64_t counts = 0;  // after direction
    std::int64_t utime = 0;   // us; 0 unknown, or from the file
  };
  std::optional<Datum> datum = {};
  struct Position {
    std::int64_t counts = 0;  // after direction, before the datum
    std::int64_t utime = 0;   // us
  };
  std::optional<Position> position = {};  // of the last valid reading
};

// With strings as long as lcmtypes/ allows, a HELLO of so many fits one message.
inline constexpr std::size_t kDevicesPerHello = 8;

[[nodiscard]] driver_device_t MessageOf(const DeviceSummary& device);

}  // namespace axlecast
