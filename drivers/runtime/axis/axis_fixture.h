#pragma once

#include <gtest/gtest.h>
#include <axlecast/alarm_t.hpp>
#include <axlecast/device_info_t.hpp>
#include <axlecast/position_block_t.hpp>
#include <axlecast/position_t.hpp>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "core/config/machine_config.h"
#include "core/device/reading.h"
#include "drivers/runtime/axis/axis.h"
#include "drivers/runtime/axis/device_publisher.h"
#include "tests/support/memory_sink.h"

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

// A reading of the encoder at `counts` of its whole range, with a timestamp known to +-`half_width`.
inline Sample ReadingAt(MonoNs at, std::int64_t counts, MonoNs half_width = 1 * kMicrosecond) {
  Sample sample;
  sample.at = {at - half_width, at + half_width};
  sample.counts = counts & (TestDevice::kTurn - 1);
  sample.turns = static_cast<std::int32_t>((counts >> 17) & (TestDevice::kRange - 1));
  sample.has_turns = true;
  return sample;
}

// Feeds one axis with readings 1 ms apart.
class AxisTest : public testing::Test {
 protected:
  void Make() {
    axis_.emplace(device_.config);
    t_ = kSecond;
  }
  AxisReading Read(std::int64_t counts) { return Read(ReadingAt(t_, counts)); }
  AxisReading Read(Sample sample) {
    t_ += kMillisecond;
    return axis_->Take(sample);
  }
  // Two readings that begin the counting.
  AxisReading Settle(std::int64_t counts) {
    Read(counts);
    return Read(counts);
  }
  Sample SingleTurn(std::int64_t counts) {
    Sample sample = ReadingAt(t_, counts);
    sample.has_turns = false;
    sample.turns = 0;
    return sample;
  }
  // A datum set now, by an operator at the axis.
  void Home(std::int64_t counts) { axis_->SetDatum({counts, 1}, t_, t_); }
  // A datum of an earlier day.
  void Restore(std::int64_t counts) { axis_->SetDatum({counts, 1}, -kSecond * 3'600, t_); }

  TestDevice device_;
  std::optional<Axis> axis_;
  MonoNs t_ = 0;
};

inline bool Has(const AxisReading& reading, std::int32_t flag) { return (reading.flags & flag) != 0; }

inline constexpr std::int32_t kUsable = 0x01 | 0x02;  // VALID, TURNS_VALID

// One channel on a bus that polls at 1 kHz and ticks every 100 ms.
class ChannelTest : public testing::Test {
 protected:
  static constexpr std::int64_t kBoot = 77;
  static constexpr std::int64_t kUtcAtZero = 1'700'000'000'000'000;  // us, when CLOCK_MONOTONIC was 0

  void Make() {
    time_.Update(t_, kUtcAtZero + t_ / kMicrosecond);
    channel_.emplace(device_.bus, device_.config,
                     DevicePublisherContext{{.boot_id = kBoot}, &time_, &sink_, {}, redecoded_});
    channel_->OnLink(true, "", t_);
  }
  void Pass() {
    t_ += kMillisecond;
    if (t_ % (100 * kMillisecond) == 0) channel_->Tick(t_);
  }
  void Read(std::int64_t counts, int times = 1) {
    for (int i = 0; i < times; ++i) Read(ReadingAt(t_, counts));
  }
  void Read(Sample sample) {
    channel_->OnSample(sample);
    Pass();
  }
  void Fail(int times, ErrorKind kind = ErrorKind::kTimeout) {
    for (int i = 0; i < times; ++i) {
      channel_->OnError(kind, {t_, t_});
      Pass();
    }
  }
  std::int64_t UtcNow() const { return kUtcAtZero + t_ / kMicrosecond; }

  std::vector<position_t> Positions() const { return sink_.All<position_t>("POSITION/axis1"); }
  std::vector<position_block_t> Blocks() const { return sink_.All<position_block_t>("POSITION_BLOCK/axis1"); }
  std::vector<device_info_t> Infos() const { return sink_.All<device_info_t>("DEVICE/axis1"); }
  std::vector<alarm_t> Alarms() const { return sink_.All<alarm_t>("ALARM/axis1"); }
  // The alarm of that name in the newest message.
  std::optional<alarm_entry_t> Alarm(const std::string& name) const {
    const std::vector<alarm_t> messages = Alarms();
    if (messages.empty()) return std::nullopt;
    for (const alarm_entry_t& entry : messages.back().entries) {
      if (entry.name == name) return entry;
    }
    return std::nullopt;
  }

  TestDevice device_;
  bool redecoded_ = false;
  Timebase time_;
  MemorySink sink_;
  std::optional<DevicePublisher> channel_;
  MonoNs t_ = 1'000 * kSecond;
};

}  // namespace axlecast
