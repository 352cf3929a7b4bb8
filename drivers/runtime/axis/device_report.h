#pragma once

#include <axlecast/device_info_t.hpp>
#include <cstdint>
#include <string>
#include <string_view>

#include "core/base/time.h"
#include "core/config/machine_config.h"
#include "drivers/runtime/axis/device_health.h"
#include "drivers/runtime/axis/reference.h"

namespace axlecast {

// The device_info_t of one device.
class DeviceReport {
 public:
  DeviceReport(const BusConfig& bus, const DeviceConfig& device, std::int64_t boot_id);

  void SetIdentity(std::int64_t identity, std::string_view serial, std::string_view firmware);
  // What a person would tell it apart by: "17", "17 SN0042"; empty unknown.
  [[nodiscard]] std::string_view identity() const { return identity_; }
  void SetProductCode(std::string_view code);
  void CountNonVolatileWrite();
  [[nodiscard]] std::int64_t nv_writes() const { return info_.nv_writes; }
  // Increments with every change made here.
  [[nodiscard]] std::int64_t revision() const { return revision_; }

  // The message as of `now`; its seq is the next one.
  [[nodiscard]] const device_info_t& Write(const DeviceHealth& health, const Reference& reference,
                                           const Timebase& time, MonoNs now);

  // A reading older than this is stale: three readings or messages that failed to come, and at least 20 ms.
  [[nodiscard]] static MonoNs MaxAge(MonoNs poll, MonoNs publish);

 private:
  device_info_t info_;
  std::string identity_;
  std::int64_t revision_ = 0;
  std::int64_t health_revision_ = -1;
};

// Time between two readings of one device: its own, the configured one, or what the bus allows.
[[nodiscard]] MonoNs PollPeriod(const BusConfig& bus, const DeviceConfig& device);

}  // namespace axlecast
