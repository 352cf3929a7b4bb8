#include "drivers/runtime/driver/operations.h"

#include <gmock/gmock.h>

#include <algorithm>
#include <axlecast/command_status_t.hpp>
#include <axlecast/device_info_t.hpp>
#include <axlecast/driver_status_t.hpp>
#include <axlecast/permit_body_t.hpp>
#include <axlecast/permit_t.hpp>
#include <axlecast/position_t.hpp>
#include <memory>

#include "drivers/runtime/command/order_test_support.h"
#include "tests/support/fake_clock.h"
#include "tests/support/memory_sink.h"
#include "tests/support/polled_device.h"
#include "tests/support/polled_family.h"

namespace axlecast {
namespace {

using ::testing::HasSubstr;
using Status = command_status_t;

constexpr std::int64_t kBoot = 42;

class OperationsTest : public ::testing::Test {
 protected:
  OperationsTest() {
    time_.Update(clock_.Now(), clock_.UtcMicroseconds());
    operations_.Add(bus_.devices[0], channel_, device_);
  }

  // The device is ONLINE and stands at `counts`.
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
    desk_.OnDriverCommand(Enveloped(order));
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
  driver_status_t Do(const driver_order_t& order) {
    Send(order);
    return Answer(order);
  }
  void DeviceAnswers() {
    const auto reply = PolledDevice::Reply(0, PolledDevice::kTouch, 1'000);
    const Step step = device_.Next({.now = clock_.Now(), .live_due = true});
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
    desk_.OnPermit("axis1", Enveloped(body));
  }

  FakeClock clock_;
  Timebase time_;
  MemorySink sink_;
  BusConfig bus_ = PolledBus(1);
  OrderDesk desk_{bus_, UnsignedBridge(), {.boot_id = kBoot, .clock = &clock_, .sink = &sink_, .wake = [] {}}};
  Operations operations_{PolledFamily(), desk_, time_, [](LogLevel, std::string_view) {}};
  Channel channel_{bus_,
                   bus_.devices[0],
                   {.boot_id = kBoot,
                    .time = &time_,
                    .sink = &sink_,
                    .on_outcome = [this](const std::string& device, const CommandId& id, const Outcome& outcome) {
                      operations_.OnOutcome(device, id, outcome);
                    }}};
  PolledDevice device_{0, channel_};
  std::int64_t number_ = 0;
};

TEST_F(OperationsTest, AnOrderGoesToItsDeviceAndItsOutcomeBack) {
  Online();
  const auto order = MakeOrder("touch");
  EXPECT_EQ(Do(order).state, Status::STATE_RUNNING);
  EXPECT_TRUE(operations_.Busy());
  DeviceAnswers();
  const driver_status_t answer = Answer(order);
  EXPECT_EQ(answer.state, Status::STATE_SUCCEEDED);
  EXPECT_EQ(answer.verified, 1);
  EXPECT_EQ(answer.epoch_after, channel_.summary().datum_epoch);
  EXPECT_FALSE(operations_.Busy());
}

TEST_F(OperationsTest, OneAtATimePerDevice) {
  Online();
  const auto first = MakeOrder("touch");
  const auto second = MakeOrder("touch");
  Send(first);
  EXPECT_EQ(Do(second).state, Status::STATE_ROUTED);
  DeviceAnswers();
  operations_.Poll(clock_.Now());
  EXPECT_EQ(Answer(first).state, Status::STATE_SUCCEEDED);
  EXPECT_EQ(Answer(second).state, Status::STATE_RUNNING);
}

TEST_F(OperationsTest, AnotherEpochThanTheClientSawIsRefusedFirst) {
  auto order = MakeOrder("write");  // has no permit, and the device is offline: the epoch is judged before
  order.expect_epoch = channel_.summary().datum_epoch + 1;
  const driver_status_t answer = Do(order);
  EXPECT_EQ(answer.state, Status::STATE_REJECTED);
  EXPECT_EQ(answer.reason_code, Status::REASON_EPOCH);
  order = MakeOrder("touch");
  order.expect_epoch = channel_.summary().datum_epoch;
  Online();
  EXPECT_EQ(Do(order).state, Status::STATE_RUNNING);
}

TEST_F(OperationsTest, APermitIsNeededFreshAndForThisOperation) {
  Online();
  EXPECT_EQ(Do(MakeOrder("write")).reason_code, Status::REASON_NO_PERMIT);
  Permit("something_else");
  EXPECT_EQ(Do(MakeOrder("write")).reason_code, Status::REASON_NO_PERMIT);
  Permit("write");
  EXPECT_EQ(Do(MakeOrder("write")).state, Status::STATE_RUNNING);
  DeviceAnswers();
  clock_.Advance(501 * kMillisecond);
  EXPECT_EQ(Do(MakeOrder("write")).reason_code, Status::REASON_NO_PERMIT);
}

TEST_F(OperationsTest, NoPermitWhereTheConfigurationSaysSo) {
  bus_.devices[0].permit_required = false;
  Online();
  EXPECT_EQ(Do(MakeOrder("write")).state, Status::STATE_RUNNING);
}

TEST_F(OperationsTest, ADeviceThatIsNotThereTakesNoOrder) {
  channel_.OnLink(false, "unplugged", clock_.Now());
  const driver_status_t answer = Do(MakeOrder("touch"));
  EXPECT_EQ(answer.state, Status::STATE_REJECTED);
  EXPECT_EQ(answer.reason_code, Status::REASON_DEVICE_OFFLINE);
  EXPECT_FALSE(operations_.Busy());
}

TEST_F(OperationsTest, SetDatumMakesThePresentPositionReadTheValue) {
  bus_.devices[0].unit = position_t::UNIT_COUNT;
  Online(1'000);
  const std::int32_t epoch = channel_.summary().datum_epoch;
  const driver_status_t answer = Do(MakeOrder("set_datum", {{"value", "0"}}));
  EXPECT_EQ(answer.state, Status::STATE_SUCCEEDED);
  EXPECT_EQ(answer.verified, 1);
  EXPECT_EQ(answer.epoch_after, epoch + 1);
  EXPECT_NEAR(channel_.summary().value, 0, 1e-9);
}

TEST_F(OperationsTest, SetDatumTakesCountsEvenBeforeTheDeviceAnswers) {
  const driver_status_t answer = Do(MakeOrder("set_datum", {{"counts", "-12345"}}));
  EXPECT_EQ(answer.state, Status::STATE_SUCCEEDED);
  EXPECT_EQ(Do(MakeOrder("set_datum", {{"value", "1"}})).reason_code, Status::REASON_DEVICE_OFFLINE);
}

TEST_F(OperationsTest, SetDatumRefusesWhatIsNoNumber) {
  Online();
  for (const char* text : {"", "x", "1x", "nan", "inf", "1e300", " 1"}) {
    EXPECT_EQ(Do(MakeOrder("set_datum", {{"value", text}})).reason_code, Status::REASON_BAD_ARGUMENT) << text;
  }
  for (const char* text : {"1.5", "9223372036854775807", "--1"}) {
    EXPECT_EQ(Do(MakeOrder("set_datum", {{"counts", text}})).reason_code, Status::REASON_BAD_ARGUMENT) << text;
  }
  EXPECT_EQ(Do(MakeOrder("set_datum")).reason_code, Status::REASON_BAD_ARGUMENT);
  EXPECT_EQ(Do(MakeOrder("set_datum", {{"value", "1"}, {"counts", "1"}})).reason_code, Status::REASON_BAD_ARGUMENT);
}

TEST_F(OperationsTest, TheBridgeTellsThatTheReferenceWasLost) {
  Online();
  EXPECT_EQ(Do(MakeOrder("mark_reference_lost")).state, Status::STATE_SUCCEEDED);
  EXPECT_TRUE(channel_.summary().reference_lost);
}

TEST_F(OperationsTest, AnOrderThatHasNotTouchedItsDeviceCanBeCancelled) {
  Online();
  auto order = MakeOrder("touch");
  Send(order);
  order.kind = driver_order_t::KIND_CANCEL;
  EXPECT_EQ(Do(order).state, Status::STATE_CANCELLED);
  EXPECT_FALSE(operations_.Busy());
}

TEST_F(OperationsTest, AnOrderThatHasTouchedItsDeviceGoesOn) {
  Online();
  auto order = MakeOrder("touch");
  Send(order);
  device_.OnStarted(device_.Next({.now = clock_.Now(), .live_due = true}), clock_.Now());
  order.kind = driver_order_t::KIND_CANCEL;
  EXPECT_EQ(Do(order).state, Status::STATE_RUNNING);
  operations_.Abandon(clock_.Now());
  EXPECT_TRUE(operations_.Busy());
  DeviceAnswers();
  EXPECT_EQ(Answer(order).state, Status::STATE_SUCCEEDED);
}

TEST_F(OperationsTest, AbandonCancelsWhatHasNotBegun) {
  Online();
  const auto order = MakeOrder("touch");
  Send(order);
  operations_.Abandon(clock_.Now());
  EXPECT_EQ(Answer(order).state, Status::STATE_CANCELLED);
  EXPECT_EQ(Answer(order).reason_code, Status::REASON_STOPPING);
}

}  // namespace
}  // namespace axlecast
