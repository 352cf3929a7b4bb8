#include "drivers/runtime/bus/bus_health.h"

#include <gmock/gmock.h>

#include <algorithm>
#include <cmath>
#include <memory>

#include "tests/support/memory_sink.h"
#include "tests/support/polled_device.h"
#include "tests/support/recording_output.h"
#include "tests/support/scripted_link.h"

namespace axlecast {
namespace {

using ::testing::HasSubstr;
using ::testing::IsEmpty;

constexpr MonoNs kStart = 1'000 * kSecond;

BusConfig Config(std::vector<MonoNs> wire_times) {
  BusConfig config;
  config.name = "rs485-0";
  config.link.port = "/dev/serial/by-id/usb-x";
  for (const MonoNs time : wire_times) {
    auto settings = std::make_shared<DeviceSettings>();
    settings->wire_time = time;
    DeviceConfig device;
    device.name = "axis" + std::to_string(config.devices.size() + 1);
    device.settings = settings;
    config.devices.push_back(device);
  }
  return config;
}

class Nobody final : public LinkObserver {
 public:
  void OnLink(bool, std::string_view, MonoNs) override {}
};

class BusHealthTest : public ::testing::Test {
 protected:
  BusHealthTest() {
    time_.Update(kStart, clock_.UtcMicroseconds());
    bus_.Add(device_);
  }

  bus_health_t RunUntil(MonoNs until) {
    while (clock_.Now() < kStart + until) bus_.RunOnce(kStart + until);
    tally_.device = "axis1";
    tally_.good = static_cast<std::int64_t>(output_.samples.size());
    tally_.errors = {};
    for (const auto& [kind, at] : output_.errors) ++tally_.errors[static_cast<std::size_t>(kind)];
    health_.Publish(clock_.Now(), bus_, {&tally_, 1});
    return sink_.All<bus_health_t>("BUS/rs485-0").back();
  }

  FakeClock clock_{kStart};
  ScriptedLink link_{clock_, PolledDevices()};
  Timebase time_;
  MemorySink sink_;
  Nobody observer_;
  RecordingOutput output_;
  PolledDevice device_{1, output_};
  Bus bus_{{.schedule = {.period = kMillisecond}}, link_, clock_, observer_, nullptr};
  BusHealth health_{Config({51 * kMicrosecond}), 42, time_, sink_};
  DeviceTally tally_;
};

// TS5669: one ID 3 exchange takes 51 us on the wire, 19.6 k readings a second (device-facts, T-format).
TEST(BusHealthWireLimitTest, FollowsFromTheDevicesWireTimes) {
  EXPECT_NEAR(BusHealth::WireLimit(Config({51 * kMicrosecond})), 19'608, 1);
  EXPECT_NEAR(BusHealth::WireLimit(Config({10 * kMillisecond, 30 * kMillisecond})), 50, 1e-9);
  EXPECT_EQ(BusHealth::WireLimit(Config({10 * kMillisecond, 0})), 0);
  EXPECT_EQ(BusHealth::WireLimit(Config({})), 0);
}

TEST_F(BusHealthTest, RatesCoverTheWindowSinceTheLastMessage) {
  static_cast<void>(RunUntil(0));
  static_cast<void>(RunUntil(kSecond));
  const bus_health_t message = RunUntil(2 * kSecond);
  EXPECT_EQ(message.state, bus_health_t::STATE_UP);
  EXPECT_EQ(message.window_us, 1'000'000);
  EXPECT_EQ(message.exchanges, 2'000);
  EXPECT_EQ(message.good, 2'000);
  EXPECT_NEAR(message.rate_hz, 1'000, 1);
  EXPECT_NEAR(message.wire_limit_hz, 19'608, 1);
  EXPECT_NEAR(message.utilisation, 0.051, 0.0001);
  EXPECT_FLOAT_EQ(message.exchange_us[0], 100);
  EXPECT_NEAR(message.exchange_us[1], 100, 0.8);
  EXPECT_FLOAT_EQ(message.exchange_us[3], 100);
  EXPECT_EQ(message.seq, 2);
  EXPECT_EQ(message.boot_id, 42);
  EXPECT_EQ(message.can_tec, -1);
  EXPECT_THAT(message.last_error, IsEmpty());
}

TEST_F(BusHealthTest, ExchangeTimesAreThoseSinceTheStart) {
  static_cast<void>(RunUntil(kSecond));
  static_cast<void>(RunUntil(2 * kSecond));
  const auto messages = sink_.All<exchange_times_t>("BUS_TIMES/rs485-0");
  ASSERT_EQ(messages.size(), 2U);
  const exchange_times_t& times = messages.back();
  EXPECT_EQ(times.bus, "rs485-0");
  EXPECT_EQ(times.boot_id, 42);
  EXPECT_EQ(times.seq, 1);
  EXPECT_EQ(times.mono_ns, clock_.Now());
  EXPECT_EQ(times.total, 2'000);
  EXPECT_EQ(times.sum_us, 2'000 * 100);
  const auto bound = std::find(times.bound_us.begin(), times.bound_us.end(), 100);
  ASSERT_NE(bound, times.bound_us.end());
  const auto i = static_cast<std::size_t>(bound - times.bound_us.begin());
  EXPECT_EQ(times.within[i], 2'000);
  EXPECT_EQ(times.within[i - 1], 0);
}

TEST_F(BusHealthTest, TimesAreThoseOfTheWindowAlone) {
  int requests = 0;
  link_.SetPeer([&](Bytes request) -> std::vector<ScriptedLink::Burst> {
    const MonoNs after = ++requests == 1 ? 700 * kMicrosecond : 100 * kMicrosecond;
    return {{after, PolledDevice::Reply(request[0], request[1], 0)}};
  });
  EXPECT_FLOAT_EQ(RunUntil(kSecond).exchange_us[3], 700);
  EXPECT_FLOAT_EQ(RunUntil(2 * kSecond).exchange_us[3], 100);
}

TEST_F(BusHealthTest, WithoutAnExchangeTheTimesAreUnknown) {
  link_.RefuseOpens(1'000, "/dev/serial/by-id/usb-x is not there: plug the adapter in");
  const bus_health_t message = RunUntil(kSecond);
  EXPECT_EQ(message.state, bus_health_t::STATE_DOWN);
  EXPECT_TRUE(std::isnan(message.exchange_us[1]));
  EXPECT_EQ(message.rate_hz, 0);
  EXPECT_THAT(message.last_error, HasSubstr("plug the adapter in"));
  EXPECT_EQ(message.last_error_utime, clock_.UtcMicroseconds());
}

TEST_F(BusHealthTest, ABusThatWasNeverTriedIsStarting) {
  health_.Publish(kStart, bus_, {});
  EXPECT_EQ(sink_.All<bus_health_t>("BUS/rs485-0").back().state, bus_health_t::STATE_STARTING);
}

TEST_F(BusHealthTest, FailedReadingsDegradeItAndTheMostFrequentIsNamed) {
  static_cast<void>(RunUntil(kSecond));
  int requests = 0;
  link_.SetPeer([&](Bytes request) -> std::vector<ScriptedLink::Burst> {
    auto reply = PolledDevice::Reply(request[0], request[1], 0);
    if (++requests % 10 == 0) reply[4] ^= 1;
    return {{100 * kMicrosecond, reply}};
  });
  bus_health_t message = RunUntil(2 * kSecond);
  EXPECT_EQ(message.state, bus_health_t::STATE_DEGRADED);
  EXPECT_EQ(message.last_error, "axis1: 100 x checksum");
  EXPECT_EQ(message.errors[static_cast<std::size_t>(ErrorKind::kChecksum)], 100);
  EXPECT_EQ(message.good, 1'900);
  const std::int64_t when = message.last_error_utime;
  link_.SetPeer(PolledDevices());
  message = RunUntil(3 * kSecond);
  EXPECT_EQ(message.state, bus_health_t::STATE_UP);
  EXPECT_EQ(message.last_error_utime, when);
}

TEST_F(BusHealthTest, ALostLineIsCountedAndReopened) {
  static_cast<void>(RunUntil(0));
  link_.LoseAt(kStart + kSecond / 2);
  bus_health_t message = RunUntil(kSecond / 2);
  EXPECT_EQ(message.state, bus_health_t::STATE_DOWN);
  message = RunUntil(kSecond);
  EXPECT_EQ(message.state, bus_health_t::STATE_UP);
  EXPECT_EQ(message.errors[static_cast<std::size_t>(ErrorKind::kIo)], 1);
  EXPECT_EQ(message.reopens, 1);
  EXPECT_THAT(message.last_error, HasSubstr("the line was lost"));
}

TEST_F(BusHealthTest, WhatTheLineItselfSawIsCounted) {
  static_cast<void>(RunUntil(0));
  link_.SetErrors({.framing = 5, .dropped = 7});
  const bus_health_t message = RunUntil(kSecond);
  EXPECT_EQ(message.errors[static_cast<std::size_t>(ErrorKind::kFraming)], 5);
  EXPECT_EQ(message.rx_dropped, 7);
}

}  // namespace
}  // namespace axlecast
