#pragma once

#include <memory>

#include "core/base/time.h"
#include "core/config/machine_config.h"
#include "core/device/device.h"
#include "core/messages/message.h"
#include "drivers/runtime/axis/device_publisher.h"
#include "tests/support/fixed_secrets.h"

namespace axlecast {

// The first device of a bus with its channel, in virtual time: the campaign acts as the bus and the line.
class DeviceUnderTest {
 public:
  // The link comes up at `now`. What the channel publishes goes to `sink`.
  DeviceUnderTest(const BusConfig& bus, MessageSink& sink, MonoNs now);

  // For every step of time; the channel's Tick comes every 100 ms.
  void Tick(MonoNs now);

  [[nodiscard]] Device& device() { return *device_; }
  [[nodiscard]] const DevicePublisher& channel() const { return channel_; }

 private:
  MonoNs next_tick_ = 0;
  Timebase time_;
  DevicePublisher channel_;
  FixedSecrets secrets_;
  std::unique_ptr<Device> device_;
};

}  // namespace axlecast
