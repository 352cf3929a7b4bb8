#include "drivers/runtime/command/driver_command_server.h"

#include <gtest/gtest.h>

#include <axlecast/command_status_t.hpp>
#include <axlecast/driver_status_t.hpp>
#include <thread>

#include "tests/support/counting_family.h"
#include "tests/support/fake_clock.h"
#include "tests/support/memory_sink.h"

namespace axlecast {
namespace {

using S = command_status_t;

constexpr std::int64_t kBoot = 5;

class OrderDeskTest : public testing::Test {
 protected:
  // Sends an order with the next epoch and returns the answer.
  driver_status_t DriverCommand(driver_order_t order) {
    order.bridge_epoch = ++epoch_;
    return SendAsIs(order);
  }
  driver_status_t SendAsIs(const driver_order_t& order) {
    desk_.OnDriverCommand(Enveloped(order));
    return Last();
  }
  driver_status_t Last() const {
    const auto all = sink_.All<driver_status_t>("DRIVER_STATUS/b0");
    return all.empty() ? driver_status_t{} : all.back();
  }
  std::size_t Answers() const { return sink_.All<driver_status_t>("DRIVER_STATUS/b0").size(); }
  static driver_order_t Bump(std::uint32_t number) {
    return OrderMessage(kBoot, 0, NumberedId(number), "axis1", "bump");
  }
  static driver_order_t Of(driver_order_t order, std::int8_t kind) {
    order.kind = kind;
    return order;
  }

  FakeClock clock_;
  MemorySink sink_;
  int woken_ = 0;
  std::int64_t epoch_ = 0;
  BusConfig bus_ = CountingBus("b0", {"axis1", "axis2"});
  DriverCommandServer desk_{bus_, UnsignedBridge(), {kBoot, &clock_, &sink_, [this] { ++woken_; }}};
};

TEST_F(OrderDeskTest, AcknowledgesAtOnceAndHandsTheOrderOver) {
  const auto answer = DriverCommand(Bump(1));
  EXPECT_EQ(answer.state, S::STATE_ROUTED);
  EXPECT_EQ(answer.bridge_epoch, 1);
  EXPECT_EQ(answer.bus, "b0");
  EXPECT_EQ(woken_, 1);
  const auto taken = desk_.Take();
  ASSERT_TRUE(taken);
  EXPECT_EQ(taken->device, "axis1");
  EXPECT_EQ(taken->order.operation, "bump");
  EXPECT_EQ(taken->order.begin_by, clock_.Now() + kSecond);
  EXPECT_EQ(Last().state, S::STATE_RUNNING);
  EXPECT_FALSE(desk_.Take());
}

TEST_F(OrderDeskTest, ARepeatedIdIsAnsweredNeverDoneAgain) {
  DriverCommand(Bump(1));
  ASSERT_TRUE(desk_.Take());
  EXPECT_EQ(DriverCommand(Bump(1)).state, S::STATE_RUNNING);
  desk_.Report("axis1", NumberedId(1), {.state = CommandState::kSucceeded, .verified = true}, 3);
  EXPECT_EQ(Last().state, S::STATE_SUCCEEDED);
  EXPECT_EQ(DriverCommand(Bump(1)).state, S::STATE_SUCCEEDED);
  EXPECT_EQ(Last().epoch_after, 3);
  EXPECT_EQ(Last().verified, 1);
  EXPECT_FALSE(desk_.Take());
}

TEST_F(OrderDeskTest, TheFirstFinalOutcomeStands) {
  DriverCommand(Bump(1));
  ASSERT_TRUE(desk_.Take());
  desk_.Report("axis1", NumberedId(1), {.state = CommandState::kFailed}, -1);
  desk_.Report("axis1", NumberedId(1), {.state = CommandState::kSucceeded}, -1);
  EXPECT_EQ(DriverCommand(Of(Bump(1), driver_order_t::KIND_QUERY)).state, S::STATE_FAILED);
}

TEST_F(OrderDeskTest, RefusesWithWhatWouldBeRight) {
  auto order = Bump(1);
  order.device = "axis9";
  EXPECT_EQ(DriverCommand(order).reason_code, S::REASON_UNKNOWN_DEVICE);
  EXPECT_EQ(Last().text, "no such device on b0; it has: axis1 axis2");
  order = Bump(2);
  order.operation = "explode";
  EXPECT_EQ(DriverCommand(order).reason_code, S::REASON_UNKNOWN_OPERATION);
  EXPECT_EQ(Last().text,
            "no such operation; operations of counting: bump write mark halt look acknowledge_alarm shelve_alarm "
            "unshelve_alarm set_datum clear_datum undo_datum accept_exchange");
  order = Bump(3);
  order.operation = "write";
  order.arguments = {{"address", "1"}};
  order.n_arguments = 1;
  EXPECT_EQ(DriverCommand(order).reason_code, S::REASON_BAD_ARGUMENT);
  EXPECT_EQ(Last().text, "argument bytes is missing: write takes address, bytes, note (optional)");
  order = Bump(4);
  order.arguments = {{"force", "1"}};
  order.n_arguments = 1;
  EXPECT_EQ(DriverCommand(order).text, "unknown argument force: bump takes no argument");
  EXPECT_EQ(Last().state, S::STATE_REJECTED);
  order = Bump(5);
  order.valid_ms = 0;
  EXPECT_EQ(DriverCommand(order).reason_code, S::REASON_MALFORMED);
  EXPECT_FALSE(desk_.Take());
}

TEST_F(OrderDeskTest, AnotherBootIgnoresTheOrder) {
  auto order = Bump(1);
  order.driver_boot_id = kBoot + 1;
  DriverCommand(order);
  EXPECT_EQ(Answers(), 0u);
  EXPECT_FALSE(desk_.Take());
}

TEST_F(OrderDeskTest, AnOvertakenOrderDoesNotAct) {
  epoch_ = 10;
  DriverCommand(Bump(1));
  auto late = Bump(2);
  late.bridge_epoch = 10;
  EXPECT_EQ(SendAsIs(late).state, S::STATE_UNKNOWN);
  EXPECT_EQ(Last().reason_code, S::REASON_FENCED);
  EXPECT_EQ(Last().bridge_epoch, 11);
}

TEST_F(OrderDeskTest, AnAnswerUnknownFencesWhatIsStillUnderWay) {
  epoch_ = 5;
  EXPECT_EQ(DriverCommand(Of(Bump(1), driver_order_t::KIND_QUERY)).state, S::STATE_UNKNOWN);
  auto late = Bump(1);
  late.bridge_epoch = 4;
  EXPECT_EQ(SendAsIs(late).reason_code, S::REASON_FENCED);
  EXPECT_FALSE(desk_.Take());
}

TEST_F(OrderDeskTest, ANewBridgeTakesOverAndTheOldOneIsRefused) {
  epoch_ = 1'000;
  DriverCommand(Bump(1));
  auto from_new = Bump(2);
  from_new.bridge_boot_id = 78;
  from_new.bridge_epoch = 1;
  EXPECT_EQ(SendAsIs(from_new).state, S::STATE_UNKNOWN);
  EXPECT_EQ(Last().reason_code, S::REASON_FENCED);
  EXPECT_EQ(Last().bridge_epoch, 1'001);  // above which it must go
  EXPECT_FALSE(woken_ > 1);
  from_new.bridge_epoch = 1'002;
  EXPECT_EQ(SendAsIs(from_new).state, S::STATE_ROUTED);
  EXPECT_EQ(Last().bridge_epoch, 1'002);
  epoch_ = 2'000;
  EXPECT_EQ(DriverCommand(Bump(3)).reason_code, S::REASON_FENCED);
  EXPECT_EQ(Last().state, S::STATE_REJECTED);
  // What the old bridge began is answered to the new one.
  auto query = Of(Bump(1), driver_order_t::KIND_QUERY);
  query.bridge_boot_id = 78;
  query.bridge_epoch = 1'003;
  EXPECT_EQ(SendAsIs(query).state, S::STATE_ROUTED);
}

TEST_F(OrderDeskTest, OneOrderAtATimePerDeviceInOrder) {
  DriverCommand(Bump(1));
  DriverCommand(Bump(2));
  auto other = Bump(3);
  other.device = "axis2";
  DriverCommand(other);
  EXPECT_EQ(desk_.Take()->order.id, NumberedId(1));
  EXPECT_EQ(desk_.Take()->order.id, NumberedId(3));
  EXPECT_FALSE(desk_.Take());
  desk_.Report("axis1", NumberedId(1), {.state = CommandState::kSucceeded}, -1);
  EXPECT_EQ(desk_.Take()->order.id, NumberedId(2));
}

TEST_F(OrderDeskTest, AFullQueueRefuses) {
  for (std::uint32_t i = 0; i < DriverCommandServer::kMaxWaiting; ++i)
    EXPECT_EQ(DriverCommand(Bump(i)).state, S::STATE_ROUTED);
  EXPECT_EQ(DriverCommand(Bump(99)).reason_code, S::REASON_QUEUE_FULL);
}

TEST_F(OrderDeskTest, CancelsWhatWaits) {
  DriverCommand(Bump(1));
  EXPECT_EQ(DriverCommand(Of(Bump(1), driver_order_t::KIND_CANCEL)).state, S::STATE_CANCELLED);
  EXPECT_FALSE(desk_.Take());
}

TEST_F(OrderDeskTest, ACancelThatOvertakesItsOrderKeepsItFromActing) {
  EXPECT_EQ(DriverCommand(Of(Bump(1), driver_order_t::KIND_CANCEL)).state, S::STATE_CANCELLED);
  EXPECT_EQ(DriverCommand(Bump(1)).state, S::STATE_CANCELLED);
  EXPECT_FALSE(desk_.Take());
}

TEST_F(OrderDeskTest, AsksTheDeviceOnceToGiveUpWhatItHolds) {
  DriverCommand(Bump(1));
  ASSERT_TRUE(desk_.Take());
  EXPECT_FALSE(desk_.TakeCancel());
  EXPECT_EQ(DriverCommand(Of(Bump(1), driver_order_t::KIND_CANCEL)).state, S::STATE_RUNNING);
  DriverCommand(Of(Bump(1), driver_order_t::KIND_CANCEL));
  EXPECT_EQ(desk_.TakeCancel()->order.id, NumberedId(1));
  EXPECT_FALSE(desk_.TakeCancel());
  desk_.Report("axis1", NumberedId(1), {.state = CommandState::kCancelled}, -1);
  EXPECT_EQ(Last().state, S::STATE_CANCELLED);
}

TEST_F(OrderDeskTest, WhatWaitsTooLongExpires) {
  DriverCommand(Bump(1));
  clock_.Advance(kSecond + 1);
  EXPECT_FALSE(desk_.Take());
  EXPECT_EQ(Last().state, S::STATE_EXPIRED);
  EXPECT_EQ(Last().reason_code, S::REASON_DEADLINE);
}

TEST_F(OrderDeskTest, ProgressIsPublishedAtMostEvery50Ms) {
  DriverCommand(Bump(1));
  ASSERT_TRUE(desk_.Take());
  const std::size_t before = Answers();
  desk_.Report("axis1", NumberedId(1), {.progress = 0.1f}, -1);
  EXPECT_EQ(Answers(), before);
  clock_.Advance(50 * kMillisecond);
  desk_.Report("axis1", NumberedId(1), {.text = "3 of 10", .progress = 0.3f}, -1);
  EXPECT_EQ(Answers(), before + 1);
  EXPECT_FLOAT_EQ(Last().progress, 0.3f);
  EXPECT_EQ(Last().text, "3 of 10");
}

TEST_F(OrderDeskTest, ForgottenIdsStillDoNotActAgain) {
  for (std::uint32_t i = 0; i <= DriverCommandServer::kMaxRemembered; ++i) {
    DriverCommand(Bump(i));
    ASSERT_TRUE(desk_.Take());
    desk_.Report("axis1", NumberedId(i), {.state = CommandState::kSucceeded}, -1);
    sink_.Clear();
  }
  auto first = Bump(0);
  first.bridge_epoch = 1;
  EXPECT_EQ(SendAsIs(first).state, S::STATE_UNKNOWN);
  EXPECT_FALSE(desk_.Take());
  EXPECT_EQ(DriverCommand(Of(Bump(1), driver_order_t::KIND_QUERY)).state, S::STATE_SUCCEEDED);
}

TEST_F(OrderDeskTest, LongStringsFitTheMessage) {
  DriverCommand(Bump(1));
  ASSERT_TRUE(desk_.Take());
  Outcome outcome{.state = CommandState::kSucceeded, .text = std::string(5'000, 't')};
  for (int i = 0; i < 9; ++i) {
    outcome.changes.push_back({std::string(900, 'k'), std::string(900, 'b'), std::string(900, 'a')});
  }
  desk_.Report("axis1", NumberedId(1), outcome, -1);
  EXPECT_EQ(Last().text.size(), 200u);
  ASSERT_EQ(Last().n_changes, 4);
  EXPECT_EQ(Last().changes[3].after.size(), 80u);
}

TEST_F(OrderDeskTest, HelloNamesEveryDevice) {
  std::vector<DriverCommandServer::DeviceSummary> devices;
  for (int i = 0; i < 20; ++i) devices.push_back({"unit" + std::to_string(i), 2, 7, i == 19});
  desk_.Hello(devices);
  const auto hellos = sink_.All<driver_status_t>("DRIVER_STATUS/b0");
  ASSERT_EQ(hellos.size(), 3u);
  EXPECT_EQ(hellos[0].kind, driver_status_t::KIND_HELLO);
  EXPECT_EQ(hellos[0].n_devices, 8);
  EXPECT_EQ(hellos[0].devices[0].has_datum, 0);
  EXPECT_EQ(hellos[0].devices[0].has_position, 0);
  EXPECT_EQ(hellos[2].n_devices, 4);
  EXPECT_EQ(hellos[2].devices[3].device, "unit19");
  EXPECT_EQ(hellos[2].devices[3].reference_lost, 1);
  EXPECT_EQ(hellos[1].seq, 1);
}

TEST_F(OrderDeskTest, ACleanStopAnswersEverything) {
  DriverCommand(Bump(1));
  ASSERT_TRUE(desk_.Take());
  DriverCommand(Bump(2));
  sink_.Clear();
  desk_.Goodbye();
  const auto said = sink_.All<driver_status_t>("DRIVER_STATUS/b0");
  ASSERT_EQ(said.size(), 3u);
  EXPECT_EQ(said[0].state, S::STATE_REJECTED);
  EXPECT_EQ(said[1].state, S::STATE_INDETERMINATE);
  EXPECT_EQ(said[2].kind, driver_status_t::KIND_GOODBYE);
  EXPECT_EQ(DriverCommand(Bump(3)).reason_code, S::REASON_STOPPING);
}

TEST_F(OrderDeskTest, BadBytesAreIgnored) {
  desk_.OnDriverCommand({});
  auto bytes = Enveloped(Bump(1));
  bytes.pop_back();
  desk_.OnDriverCommand(bytes);
  auto order = Bump(1);
  order.kind = 9;
  DriverCommand(order);
  EXPECT_EQ(Answers(), 0u);
  EXPECT_EQ(desk_.refused(), 3);
}

// To be run under -fsanitize=thread as well: both threads at once, every order ends once.
TEST(OrderDeskThreads, TwoThreads) {
  struct Sink final : MessageSink {
    void Publish(const std::string&, Bytes) override {}
  } sink;
  FakeClock clock;
  const BusConfig bus = CountingBus("b0", {"axis1", "axis2"});
  DriverCommandServer desk(bus, UnsignedBridge(), {kBoot, &clock, &sink, [] {}});
  constexpr std::uint32_t kOrders = 5'000;
  std::atomic<bool> sent = false;
  std::thread bus_thread([&] {
    const DriverCommandServer::DeviceSummary summary{"axis1", 2, 0, false};
    while (true) {
      const bool last_round = sent;
      if (const auto cancel = desk.TakeCancel()) {
        desk.Report(cancel->device, cancel->order.id, {.state = CommandState::kCancelled}, -1);
      }
      const auto taken = desk.Take();
      if (taken) {
        (void)desk.HasPermit(taken->device, taken->order.operation);
        desk.Report(taken->device, taken->order.id, {.state = CommandState::kSucceeded}, -1);
        desk.Hello({&summary, 1});
      } else if (last_round) {
        break;
      }
    }
  });
  for (std::uint32_t i = 0; i < kOrders; ++i) {
    auto order = OrderMessage(kBoot, 2 * i + 1, NumberedId(i), i % 2 == 0 ? "axis1" : "axis2", "bump");
    desk.OnDriverCommand(Enveloped(order));
    order.kind = i % 3 == 0 ? driver_order_t::KIND_CANCEL : driver_order_t::KIND_QUERY;
    order.bridge_epoch = 2 * i + 2;
    desk.OnDriverCommand(Enveloped(order));
    desk.OnPermit("axis1", {});
  }
  sent = true;
  bus_thread.join();
  EXPECT_FALSE(desk.Take());
  desk.Goodbye();
}

}  // namespace
}  // namespace axlecast
