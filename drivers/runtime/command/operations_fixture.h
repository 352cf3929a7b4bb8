#pragma once

#include <gtest/gtest.h>

#include <algorithm>
#include <axlecast/device_info_t.hpp>
#include <axlecast/driver_status_t.hpp>
#include <string>
#include <vector>

#include "drivers/runtime/command/operations.h"
#include "tests/support/counting_family.h"
#include "tests/support/fake_clock.h"
#include "tests/support/memory_sink.h"
#include "tests/support/polled_device.h"
#include "tests/support/polled_family.h"

namespace axlecast {

// Operations on one channel and its device; the test is the bus.
class OperationsTest : public testing::Test {
 protected:
  static constexpr std::int64_t kBoot = 42;

  explicit OperationsTest(BusConfig bus = PolledBus(1)) : bus_(std::move(bus)) {
    time_.Update(clock_.Now(), clock_.UtcMicroseconds());
    operations_.Add(bus_.devices[0], channel_, device_);
  }

  // The device is ONLINE, and its shaft is at `counts`.
  void Online(std::int64_t counts = 1'000) {
    channel_.OnLink(true, "", clock_.Now());
    for (int i = 0; i < 200; ++i) {
      clock_.Advance(kMillisecond);
      channel_.OnSample({.at = {clock_.Now(), clock_.Now()}, .counts = counts});
    }
    channel_.Tick(clock_.Now());
    ASSERT_EQ(channel_.summary().state, device_info_t::STATE_ONLINE);
  }

  driver_order_t MakeOrder(const std::string& operation, const std::vector<argument_t>& arguments = {}) {
    ++number_;
    driver_order_t order =
        OrderMessage(kBoot, number_, NumberedId(static_cast<std::uint32_t>(number_)), "axis1", operation);
    order.arguments = arguments;
    order.n_arguments = static_cast<std::int8_t>(arguments.size());
    return order;
  }
  void Send(const driver_order_t& order) {
    server_.OnDriverCommand(Enveloped(order));
    operations_.Poll(clock_.Now());
  }
  // The last word on the order.
  driver_status_t Answer(const driver_order_t& order) {
    driver_status_t last{};
    for (const driver_status_t& status : sink_.All<driver_status_t>("DRIVER_STATUS/rs485-0")) {
      if (std::equal(std::begin(order.id), std::end(order.id), std::begin(status.id))) last = status;
    }
    return last;
  }
  // The last status of all.
  driver_status_t Last() { return sink_.All<driver_status_t>("DRIVER_STATUS/rs485-0").back(); }
  driver_status_t Do(const driver_order_t& order) {
    Send(order);
    return Answer(order);
  }
  void DeviceAnswers() {
    const auto reply = PolledDevice::Reply(0, PolledDevice::kTouch, 1'000);
    const Step step = device_.Next({.now = clock_.Now(), .poll_due = true});
    device_.OnStarted(step, clock_.Now());
    device_.On({.kind = Event::Kind::kReply,
                .sent = {clock_.Now(), clock_.Now()},
                .received = {clock_.Now(), clock_.Now()},
                .request = {},
                .bytes = reply});
  }
  void Permit(const std::string& operation) {
    permit_body_t body{};
    body.device = "axis1";
    body.issuer_boot_id = 9;
    body.issue = ++number_;
    body.issued_utime = clock_.UtcMicroseconds();
    body.valid_ms = 500;
    body.operations = {operation};
    body.n_operations = 1;
    server_.OnPermit("axis1", Enveloped(body));
  }

  FakeClock clock_;
  Timebase time_;
  MemorySink sink_;
  BusConfig bus_;
  DriverCommandServer server_{
      bus_, UnsignedBridge(), {.origin = {.boot_id = kBoot}, .clock = &clock_, .sink = &sink_, .wake = [] {}}};
  Operations operations_{*bus_.family, server_, time_, [](LogLevel, std::string_view) {}};
  DevicePublisher channel_{
      bus_,
      bus_.devices[0],
      {.origin = {.boot_id = kBoot},
       .time = &time_,
       .sink = &sink_,
       .on_outcome = [this](const std::string& device, const CommandId& id, const Outcome& outcome) {
         operations_.OnOutcome(device, id, outcome);
       }}};
  PolledDevice device_{0, channel_};
  std::int64_t number_ = 0;
};

}  // namespace axlecast
