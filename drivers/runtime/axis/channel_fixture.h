#pragma once

#include <gtest/gtest.h>

#include <axlecast/alarm_t.hpp>
#include <axlecast/device_info_t.hpp>
#include <axlecast/position_block_t.hpp>
#include <axlecast/position_t.hpp>
#include <optional>
#include <string>
#include <vector>

#include "drivers/runtime/axis/device_publisher.h"
#include "drivers/runtime/axis/test_device.h"
#include "tests/support/memory_sink.h"

namespace axlecast {

// One channel on a bus that polls at 1 kHz and ticks every 100 ms.
class ChannelTest : public testing::Test {
 protected:
  static constexpr std::int64_t kBoot = 77;
  static constexpr std::int64_t kUtcAtZero = 1'700'000'000'000'000;  // us, when CLOCK_MONOTONIC was 0

  void Make() {
    time_.Update(t_, kUtcAtZero + t_ / kMicrosecond);
    channel_.emplace(device_.bus, device_.config, DevicePublisherContext{kBoot, &time_, &sink_, {}, redecoded_});
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
