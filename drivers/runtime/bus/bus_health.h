#pragma once

#include <array>
#include <axlecast/bus_health_t.hpp>
#include <axlecast/exchange_times_t.hpp>
#include <cstdint>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "core/base/time.h"
#include "core/config/machine_config.h"
#include "core/device/reading.h"
#include "core/messages/message.h"
#include "drivers/runtime/bus/bus.h"
#include "drivers/runtime/bus/can_watch.h"

namespace axlecast {

// Readings of one device since the driver started.
struct DeviceTally {
  std::string_view device;
  std::int64_t good = 0;
  std::array<std::int64_t, kErrorKinds> errors{};
};

// The bus towards LCM: bus_health_t on "BUS/<bus>" and exchange_times_t on "BUS_TIMES/<bus>", to be called once a second,
// and when a CAN bus's state changes.
//
// DEGRADED: the line is open, but in this window more than 1 % of the readings failed, or every one; or a CAN bus has
// an alarm of severity WARNING or above.
class BusHealth {
 public:
  BusHealth(const BusConfig& config, std::int64_t boot_id, const Timebase& time, MessageSink& sink);

  // `can` of a CAN bus, else as it is.
  void Publish(MonoNs now, Bus& bus, std::span<const DeviceTally> devices, const CanHealth& can = {});

  // Exchanges a second that the wire's timing allows with these devices, each having its turn; 0 unknown.
  [[nodiscard]] static double WireLimit(const BusConfig& config);

 private:
  void Count(const Bus& bus, std::span<const DeviceTally> devices);
  void Rates(MonoNs now, Bus& bus);
  void TakeCan(const Bus& bus, const CanHealth& can);
  void PublishTimes(const Bus& bus);
  void LastError(MonoNs now, const Bus& bus, std::span<const DeviceTally> devices, std::string_view can_trouble);

  const Timebase& time_;
  MessageSink& sink_;
  std::string channel_;
  bus_health_t message_;
  bus_health_t previous_;
  std::string times_channel_;
  exchange_times_t times_;
  double wire_limit_hz_;
  MonoNs window_start_ = 0;
  std::string seen_problem_;
  std::vector<DeviceTally> seen_;
};

}  // namespace axlecast
