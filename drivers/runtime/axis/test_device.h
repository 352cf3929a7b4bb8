#pragma once

#include <memory>

#include "core/config/machine_config.h"
#include "core/device/reading.h"

namespace axlecast {

// A TS5669 as the tests of this folder configure it: 17 bits, 16 bits of turns, 6,000 min-1, 80,000 rad/s2.
struct TestDevice {
  static constexpr std::int64_t kTurn = 1 << 17;
  static constexpr std::int64_t kRange = 1 << 16;

  TestDevice() {
    settings->model = "ts5669n127";
    settings->counts_per_turn = kTurn;
    settings->turns_range = kRange;
    settings->max_speed_rpm = 6'000;
    settings->max_accel_rad_s2 = 80'000;
    settings->noise_counts = 4;
    config.name = "axis1";
    config.model = settings->model;
    config.settings = settings;
    bus.name = "rs485-0";
    bus.poll_hz = 1'000;
  }

  std::shared_ptr<DeviceSettings> settings = std::make_shared<DeviceSettings>();
  DeviceConfig config;
  BusConfig bus;
};

// A reading of the encoder standing at `counts` of its whole range, with an instant known to +-`half_width`.
inline Sample ReadingAt(MonoNs at, std::int64_t counts, MonoNs half_width = 1 * kMicrosecond) {
  Sample sample;
  sample.at = {at - half_width, at + half_width};
  sample.counts = counts & (TestDevice::kTurn - 1);
  sample.turns = static_cast<std::int32_t>((counts >> 17) & (TestDevice::kRange - 1));
  sample.has_turns = true;
  return sample;
}

}  // namespace axlecast
