#include <gtest/gtest.h>
#include <atomic>
#include <axlecast/command_status_t.hpp>
#include <axlecast/driver_status_t.hpp>
#include <thread>

#include "drivers/runtime/command/command_server_fixture.h"
#include "drivers/runtime/command/driver_command_server.h"
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
    server_.OnDriverCommand(Enveloped(order));
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
  DriverCommandServer server_{bus_, UnsignedBridge(), {{.boot_id = kBoot}, &clock_, &sink_, [this] { ++woken_; }}};
};

TEST_F(OrderDeskTest, AcknowledgesAtOnceAndHandsTheOrderOver) {
  const auto answer = DriverCommand(Bump(1));
  EXPECT_EQ(answer.state, S::STATE_ROUTED);
  EXPECT_EQ(answer.bridge_epoch, 1);
  EXPECT_EQ(answer.bus, "b0");
  EXPECT_EQ(woken_, 1);
  const auto taken = server_.Take();
  ASSERT_TRUE(taken);
  EXPECT_EQ(taken->device, "axis1");
  EXPECT_EQ(taken->command.operation, "bump");
  EXPECT_EQ(taken->command.begin_by, clock_.Now() + kSecond);
  EXPECT_EQ(Last().state, S::STATE_RUNNING);
  EXPECT_FALSE(server_.Take());
}

TEST_F(OrderDeskTest, ARepeatedIdIsAnsweredNeverDoneAgain) {
  DriverCommand(Bump(1));
  ASSERT_TRUE(server_.Take());
  EXPECT_EQ(DriverCommand(Bump(1)).state, S::STATE_RUNNING);
  server_.Report("axis1", NumberedId(1), {.state = CommandState::kSucceeded, .verified = true}, 3);
  EXPECT_EQ(Last().state, S::STATE_SUCCEEDED);
  EXPECT_EQ(DriverCommand(Bump(1)).state, S::STATE_SUCCEEDED);
  EXPECT_EQ(Last().epoch_after, 3);
  EXPECT_EQ(Last().verified, 1);
  EXPECT_FALSE(server_.Take());
}

TEST_F(OrderDeskTest, TheFirstFinalOutcomeStands) {
  DriverCommand(Bump(1));
  ASSERT_TRUE(server_.Take());
  server_.Report("axis1", NumberedId(1), {.state = CommandState::kFailed}, -1);
  server_.Report("axis1", NumberedId(1), {.state = CommandState::kSucceeded}, -1);
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
  EXPECT_FALSE(server_.Take());
}

TEST_F(OrderDeskTest, AnotherBootIgnoresTheOrder) {
  auto order = Bump(1);
  order.driver_boot_id = kBoot + 1;
  DriverCommand(order);
  EXPECT_EQ(Answers(), 0u);
  EXPECT_FALSE(server_.Take());
}

TEST_F(OrderDeskTest, AnOvertakenOrderDoesNotAct) {
  epoch_ = 10;
  DriverCommand(Bump(1));
  auto late = Bump(2);
  late.bridge_epoch = 10;
  EXPECT_EQ(SendAsIs(late).state, S::STATE_UNKNOWN);
  EXPECT_EQ(Last().reason_code, S::REASON_FENCED);
  EXPECT_EQ(Last().bridge_epoch, 11);
  EXPECT_EQ(Last().text, "a newer command was received before this one");
}

TEST_F(OrderDeskTest, AnAnswerUnknownFencesWhatIsStillUnderWay) {
  epoch_ = 5;
  EXPECT_EQ(DriverCommand(Of(Bump(1), driver_order_t::KIND_QUERY)).state, S::STATE_UNKNOWN);
  auto late = Bump(1);
  late.bridge_epoch = 4;
  EXPECT_EQ(SendAsIs(late).reason_code, S::REASON_FENCED);
  EXPECT_FALSE(server_.Take());
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
  EXPECT_EQ(server_.Take()->command.id, NumberedId(1));
  EXPECT_EQ(server_.Take()->command.id, NumberedId(3));
  EXPECT_FALSE(server_.Take());
  server_.Report("axis1", NumberedId(1), {.state = CommandState::kSucceeded}, -1);
  EXPECT_EQ(server_.Take()->command.id, NumberedId(2));
}

TEST_F(OrderDeskTest, AFullQueueRefuses) {
  for (std::uint32_t i = 0; i < DriverCommandServer::kMaxWaiting; ++i)
    EXPECT_EQ(DriverCommand(Bump(i)).state, S::STATE_ROUTED);
  EXPECT_EQ(DriverCommand(Bump(99)).reason_code, S::REASON_QUEUE_FULL);
}

TEST_F(OrderDeskTest, CancelsWhatWaits) {
  DriverCommand(Bump(1));
  EXPECT_EQ(DriverCommand(Of(Bump(1), driver_order_t::KIND_CANCEL)).state, S::STATE_CANCELLED);
  EXPECT_FALSE(server_.Take());
}

TEST_F(OrderDeskTest, ACancelThatOvertakesItsOrderKeepsItFromActing) {
  EXPECT_EQ(DriverCommand(Of(Bump(1), driver_order_t::KIND_CANCEL)).state, S::STATE_CANCELLED);
  EXPECT_EQ(DriverCommand(Bump(1)).state, S::STATE_CANCELLED);
  EXPECT_FALSE(server_.Take());
}

TEST_F(OrderDeskTest, AsksTheDeviceOnceToGiveUpWhatItHolds) {
  DriverCommand(Bump(1));
  ASSERT_TRUE(server_.Take());
  EXPECT_FALSE(server_.TakeCancel());
  EXPECT_EQ(DriverCommand(Of(Bump(1), driver_order_t::KIND_CANCEL)).state, S::STATE_RUNNING);
  DriverCommand(Of(Bump(1), driver_order_t::KIND_CANCEL));
  EXPECT_EQ(server_.TakeCancel()->command.id, NumberedId(1));
  EXPECT_FALSE(server_.TakeCancel());
  server_.Report("axis1", NumberedId(1), {.state = CommandState::kCancelled}, -1);
  EXPECT_EQ(Last().state, S::STATE_CANCELLED);
}

TEST_F(OrderDeskTest, ACancelOfWhatADeviceHoldsIsAcknowledged) {
  DriverCommand(Bump(1));
  ASSERT_TRUE(server_.Take());
  const std::size_t before = Answers();
  DriverCommand(Of(Bump(1), driver_order_t::KIND_CANCEL));
  EXPECT_EQ(Answers(), before + 1);
}

TEST_F(OrderDeskTest, ACancelThatComesTooLateIsDropped) {
  DriverCommand(Bump(1));
  ASSERT_TRUE(server_.Take());
  DriverCommand(Of(Bump(1), driver_order_t::KIND_CANCEL));
  server_.Report("axis1", NumberedId(1), {.state = CommandState::kSucceeded}, -1);
  EXPECT_FALSE(server_.TakeCancel());
}

TEST_F(OrderDeskTest, ACancelDoesNotReachTheNextOrderOfTheDevice) {
  DriverCommand(Bump(1));
  DriverCommand(Bump(2));
  ASSERT_TRUE(server_.Take());
  DriverCommand(Of(Bump(1), driver_order_t::KIND_CANCEL));
  server_.Report("axis1", NumberedId(1), {.state = CommandState::kSucceeded}, -1);
  ASSERT_TRUE(server_.Take());
  EXPECT_FALSE(server_.TakeCancel());
  DriverCommand(Of(Bump(2), driver_order_t::KIND_CANCEL));
  EXPECT_EQ(server_.TakeCancel()->command.id, NumberedId(2));
}

TEST_F(OrderDeskTest, ACancelDoesNotReachAnotherDevice) {
  auto other = Bump(2);
  other.device = "axis2";
  DriverCommand(Bump(1));
  DriverCommand(other);
  ASSERT_TRUE(server_.Take());
  ASSERT_TRUE(server_.Take());
  DriverCommand(Of(other, driver_order_t::KIND_CANCEL));
  EXPECT_EQ(server_.TakeCancel()->device, "axis2");
}

TEST_F(OrderDeskTest, OnlyNewsWakeTheBus) {
  DriverCommand(Bump(1));
  EXPECT_EQ(woken_, 1);
  DriverCommand(Bump(1));
  DriverCommand(Of(Bump(1), driver_order_t::KIND_QUERY));
  EXPECT_EQ(woken_, 1);
  DriverCommand(Of(Bump(1), driver_order_t::KIND_CANCEL));
  EXPECT_EQ(woken_, 2);
}

TEST_F(OrderDeskTest, AnOrderIsValidForAMillisecondToAnHour) {
  for (const std::int32_t valid_ms : {1, 3'600'000}) {
    auto order = Bump(static_cast<std::uint32_t>(valid_ms));
    order.valid_ms = valid_ms;
    EXPECT_EQ(DriverCommand(order).state, S::STATE_ROUTED) << valid_ms;
  }
  auto order = Bump(2);
  order.valid_ms = 3'600'001;
  EXPECT_EQ(DriverCommand(order).reason_code, S::REASON_MALFORMED);
}

TEST_F(OrderDeskTest, AnOrderMayBeginAtTheEndOfItsTime) {
  DriverCommand(Bump(1));
  clock_.Advance(kSecond);
  EXPECT_TRUE(server_.Take());
}

TEST_F(OrderDeskTest, WhatWaitsTooLongExpires) {
  DriverCommand(Bump(1));
  clock_.Advance(kSecond + 1);
  EXPECT_FALSE(server_.Take());
  EXPECT_EQ(Last().state, S::STATE_EXPIRED);
  EXPECT_EQ(Last().reason_code, S::REASON_DEADLINE);
}

TEST_F(OrderDeskTest, ProgressIsPublishedAtMostEvery50Ms) {
  DriverCommand(Bump(1));
  ASSERT_TRUE(server_.Take());
  const std::size_t before = Answers();
  server_.Report("axis1", NumberedId(1), {.progress = 0.1f}, -1);
  EXPECT_EQ(Answers(), before);
  clock_.Advance(50 * kMillisecond);
  server_.Report("axis1", NumberedId(1), {.text = "3 of 10", .progress = 0.3f}, -1);
  EXPECT_EQ(Answers(), before + 1);
  EXPECT_FLOAT_EQ(Last().progress, 0.3f);
  EXPECT_EQ(Last().text, "3 of 10");
}

TEST_F(OrderDeskTest, ForgottenIdsStillDoNotActAgain) {
  for (std::uint32_t i = 0; i <= DriverCommandServer::kMaxRemembered; ++i) {
    DriverCommand(Bump(i));
    ASSERT_TRUE(server_.Take());
    server_.Report("axis1", NumberedId(i), {.state = CommandState::kSucceeded}, -1);
    sink_.Clear();
  }
  auto first = Bump(0);
  first.bridge_epoch = 1;
  EXPECT_EQ(SendAsIs(first).state, S::STATE_UNKNOWN);
  EXPECT_FALSE(server_.Take());
  EXPECT_EQ(DriverCommand(Of(Bump(1), driver_order_t::KIND_QUERY)).state, S::STATE_SUCCEEDED);
}

TEST_F(OrderDeskTest, LongStringsFitTheMessage) {
  DriverCommand(Bump(1));
  ASSERT_TRUE(server_.Take());
  Outcome outcome{.state = CommandState::kSucceeded, .text = std::string(5'000, 't')};
  for (int i = 0; i < 9; ++i) {
    outcome.changes.push_back({std::string(900, 'k'), std::string(900, 'b'), std::string(900, 'a')});
  }
  server_.Report("axis1", NumberedId(1), outcome, -1);
  EXPECT_EQ(Last().text.size(), 200u);
  ASSERT_EQ(Last().n_changes, 4);
  EXPECT_EQ(Last().changes[3].after.size(), 80u);
}

TEST_F(OrderDeskTest, HelloNamesEveryDevice) {
  std::vector<driver_device_t> devices;
  for (int i = 0; i < 20; ++i) {
    driver_device_t device{};
    device.device = "unit" + std::to_string(i);
    device.state = 2;
    device.datum_epoch = 7;
    device.reference_lost = i == 19 ? 1 : 0;
    devices.push_back(device);
  }
  server_.Hello(devices);
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
  ASSERT_TRUE(server_.Take());
  DriverCommand(Bump(2));
  sink_.Clear();
  server_.Goodbye();
  const auto said = sink_.All<driver_status_t>("DRIVER_STATUS/b0");
  ASSERT_EQ(said.size(), 3u);
  EXPECT_EQ(said[0].state, S::STATE_REJECTED);
  EXPECT_EQ(said[1].state, S::STATE_INDETERMINATE);
  EXPECT_EQ(said[2].kind, driver_status_t::KIND_GOODBYE);
  EXPECT_EQ(DriverCommand(Bump(3)).reason_code, S::REASON_STOPPING);
}

TEST_F(OrderDeskTest, AnOutcomeAfterACleanStopIsIgnored) {
  DriverCommand(Bump(1));
  ASSERT_TRUE(server_.Take());
  server_.Goodbye();
  server_.Report("axis1", NumberedId(1), {.state = CommandState::kSucceeded}, -1);
  EXPECT_EQ(Last().kind, driver_status_t::KIND_GOODBYE);
}

TEST_F(OrderDeskTest, BadBytesAreIgnored) {
  server_.OnDriverCommand({});
  auto bytes = Enveloped(Bump(1));
  bytes.pop_back();
  server_.OnDriverCommand(bytes);
  auto order = Bump(1);
  order.kind = 9;
  DriverCommand(order);
  EXPECT_EQ(Answers(), 0u);
  EXPECT_EQ(server_.refused(), 3);
}

// To be run under -fsanitize=thread as well: both threads at once, every order ends once.
TEST(OrderDeskThreads, TwoThreads) {
  struct Sink final : MessageSink {
    void Publish(const std::string&, Bytes) override {}
  } sink;
  FakeClock clock;
  const BusConfig bus = CountingBus("b0", {"axis1", "axis2"});
  DriverCommandServer server(bus, UnsignedBridge(), {{.boot_id = kBoot}, &clock, &sink, [] {}});
  constexpr std::uint32_t kOrders = 5'000;
  std::atomic<bool> sent = false;
  std::thread bus_thread([&] {
    driver_device_t summary{};
    summary.device = "axis1";
    summary.state = 2;
    while (true) {
      const bool last_round = sent;
      if (const auto cancel = server.TakeCancel()) {
        server.Report(cancel->device, cancel->command.id, {.state = CommandState::kCancelled}, -1);
      }
      const auto taken = server.Take();
      if (taken) {
        (void)server.CheckPermit(taken->device, taken->command.operation);
        server.Report(taken->device, taken->command.id, {.state = CommandState::kSucceeded}, -1);
        server.Hello({&summary, 1});
      } else if (last_round) {
        break;
      }
    }
  });
  for (std::uint32_t i = 0; i < kOrders; ++i) {
    auto order = OrderMessage(kBoot, 2 * i + 1, NumberedId(i), i % 2 == 0 ? "axis1" : "axis2", "bump");
    server.OnDriverCommand(Enveloped(order));
    order.kind = i % 3 == 0 ? driver_order_t::KIND_CANCEL : driver_order_t::KIND_QUERY;
    order.bridge_epoch = 2 * i + 2;
    server.OnDriverCommand(Enveloped(order));
    server.OnPermit("axis1", {});
  }
  sent = true;
  bus_thread.join();
  EXPECT_FALSE(server.Take());
  server.Goodbye();
}

class PrepareTest : public CommandServerTest {
 protected:
  PrepareTest() : CommandServerTest(driver_order_t::KIND_PREPARE) {}
};

TEST_F(PrepareTest, IsJudgedOnTheBussThreadAndNeverTaken) {
  EXPECT_EQ(Send(1).state, S::STATE_ROUTED);
  EXPECT_EQ(woken_, 1);
  EXPECT_FALSE(server_.Take());
  const auto asked = server_.TakePrepare();
  ASSERT_TRUE(asked);
  EXPECT_EQ(asked->device, "axis1");
  EXPECT_EQ(asked->command.operation, "bump");
  EXPECT_FALSE(server_.TakePrepare());
  server_.ReportPrepared(
      NumberedId(1), {.state = CommandState::kSucceeded, .text = "would", .changes = {{"position", "1", ""}}}, 4);
  EXPECT_EQ(Last().state, S::STATE_SUCCEEDED);
  EXPECT_EQ(Last().verified, 0);
  EXPECT_EQ(Last().text, "would");
  EXPECT_EQ(Last().epoch_after, 4);
  EXPECT_EQ(Last().changes.at(0).key, "position");
  EXPECT_EQ(Send(1).text, "would");  // repeated
  EXPECT_EQ(Send(1, driver_order_t::KIND_QUERY).text, "would");
  EXPECT_FALSE(server_.TakePrepare());
}

TEST_F(PrepareTest, DoesNotWaitForWhatItsDeviceWorksOn) {
  Send(1, driver_order_t::KIND_EXECUTE);
  ASSERT_TRUE(server_.Take());
  Send(2);
  EXPECT_TRUE(server_.TakePrepare());
}

TEST_F(PrepareTest, ItsIdIsOfNoUseForExecute) {
  Send(1);
  ASSERT_TRUE(server_.TakePrepare());
  server_.ReportPrepared(NumberedId(1), {.state = CommandState::kSucceeded}, 0);
  EXPECT_EQ(Send(1, driver_order_t::KIND_EXECUTE).reason_code, S::REASON_ID_REUSED);
  EXPECT_EQ(Last().state, S::STATE_REJECTED);
  Send(2, driver_order_t::KIND_EXECUTE);
  EXPECT_EQ(Send(2).reason_code, S::REASON_ID_REUSED);
  EXPECT_EQ(server_.Take()->command.id, NumberedId(2));
}

TEST_F(PrepareTest, RefusesWhatExecuteWouldRefuse) {
  EXPECT_EQ(Send(1, driver_order_t::KIND_PREPARE, "explode").reason_code, S::REASON_UNKNOWN_OPERATION);
  EXPECT_EQ(Send(2, driver_order_t::KIND_PREPARE, "write").reason_code, S::REASON_BAD_ARGUMENT);
  EXPECT_EQ(Send(3, driver_order_t::KIND_PREPARE, "undo_datum").reason_code, S::REASON_UNKNOWN_OPERATION);
  EXPECT_EQ(Last().text, "the bridge executes this operation, not a driver: send it to the bridge");
  for (std::uint32_t i = 0; i < DriverCommandServer::kMaxWaiting; ++i)
    EXPECT_EQ(Send(10 + i).state, S::STATE_ROUTED);
  EXPECT_EQ(Send(99).reason_code, S::REASON_QUEUE_FULL);
}

TEST_F(PrepareTest, IsFencedByItsEpoch) {
  Send(1);
  epoch_ -= 1;
  EXPECT_EQ(Send(2).state, S::STATE_UNKNOWN);
  EXPECT_EQ(Last().reason_code, S::REASON_FENCED);
  EXPECT_EQ(server_.TakePrepare()->command.id, NumberedId(1));
  EXPECT_FALSE(server_.TakePrepare());
}

TEST_F(PrepareTest, EndsAlsoWhenNobodyJudges) {
  Send(1);
  EXPECT_EQ(Send(1, driver_order_t::KIND_CANCEL).state, S::STATE_CANCELLED);
  Send(2);
  clock_.Advance(kSecond + 1);
  EXPECT_FALSE(server_.TakePrepare());
  EXPECT_EQ(Last().state, S::STATE_EXPIRED);
  Send(3);
  server_.Goodbye();
  EXPECT_EQ(sink_.All<driver_status_t>("DRIVER_STATUS/b0").end()[-2].reason_code, S::REASON_STOPPING);
  EXPECT_FALSE(server_.TakePrepare());
  server_.ReportPrepared(NumberedId(3), {.state = CommandState::kSucceeded}, 0);
  EXPECT_EQ(Last().kind, driver_status_t::KIND_GOODBYE);
}

TEST_F(PrepareTest, IsNotCancelledWhileItIsJudged) {
  Send(1);
  ASSERT_TRUE(server_.TakePrepare());
  EXPECT_EQ(Send(1, driver_order_t::KIND_CANCEL).state, S::STATE_ROUTED);
  server_.ReportPrepared(NumberedId(1), {.state = CommandState::kSucceeded}, 0);
  EXPECT_EQ(Last().state, S::STATE_SUCCEEDED);
}

TEST_F(PrepareTest, ItsOutcomeIsOfNoUseForExecuteOrAnUnknownId) {
  Send(1, driver_order_t::KIND_EXECUTE);
  server_.ReportPrepared(NumberedId(1), {.state = CommandState::kSucceeded}, 0);
  server_.ReportPrepared(NumberedId(2), {.state = CommandState::kSucceeded}, 0);
  EXPECT_EQ(Last().state, S::STATE_ROUTED);
}

class UrgentOrderTest : public testing::Test {
 protected:
  void Send(std::uint32_t number, const std::string& operation, const std::string& device = "axis1",
            std::int8_t kind = driver_order_t::KIND_EXECUTE) {
    driver_order_t order = OrderMessage(kBoot, ++epoch_, NumberedId(number), device, operation);
    order.kind = kind;
    server_.OnDriverCommand(Enveloped(order));
  }
  std::string Taken() {
    const auto taken = server_.Take();
    return taken ? taken->device + ' ' + taken->command.operation : "";
  }
  std::int8_t LastState() const { return sink_.All<driver_status_t>("DRIVER_STATUS/b0").back().state; }

  FakeClock clock_;
  MemorySink sink_;
  std::int64_t epoch_ = 0;
  BusConfig bus_ = CountingBus("b0", {"axis1", "axis2"});
  DriverCommandServer server_{bus_, UnsignedBridge(), {{.boot_id = kBoot}, &clock_, &sink_, [] {}}};
};

TEST_F(UrgentOrderTest, OvertakesWhatWaitsAndWhatIsHeld) {
  Send(1, "bump");
  Send(2, "bump", "axis2");
  EXPECT_EQ(Taken(), "axis1 bump");
  Send(3, "halt");
  EXPECT_EQ(Taken(), "axis1 halt");
  EXPECT_EQ(Taken(), "axis2 bump");
  EXPECT_EQ(Taken(), "");
}

TEST_F(UrgentOrderTest, EachOfTheTwoHasItsOwnOutcome) {
  Send(1, "bump");
  Send(2, "halt");
  EXPECT_EQ(Taken(), "axis1 halt");
  EXPECT_EQ(Taken(), "axis1 bump");
  server_.Report("axis1", NumberedId(2), {.state = CommandState::kSucceeded, .verified = true}, 0);
  EXPECT_EQ(LastState(), S::STATE_SUCCEEDED);
  server_.Report("axis1", NumberedId(1), {.state = CommandState::kFailed}, 0);
  EXPECT_EQ(LastState(), S::STATE_FAILED);
}

TEST_F(UrgentOrderTest, OneAtATimeToo) {
  Send(1, "halt");
  Send(2, "halt");
  EXPECT_EQ(Taken(), "axis1 halt");
  EXPECT_EQ(Taken(), "");
  server_.Report("axis1", NumberedId(1), {.state = CommandState::kSucceeded}, 0);
  EXPECT_EQ(Taken(), "axis1 halt");
}

TEST_F(UrgentOrderTest, CanBeCancelled) {
  Send(1, "halt");
  Send(1, "halt", "axis1", driver_order_t::KIND_CANCEL);
  EXPECT_EQ(LastState(), S::STATE_CANCELLED);
  EXPECT_EQ(Taken(), "");
  Send(2, "halt");
  EXPECT_EQ(Taken(), "axis1 halt");
  Send(2, "halt", "axis1", driver_order_t::KIND_CANCEL);
  const auto cancel = server_.TakeCancel();
  ASSERT_TRUE(cancel);
  EXPECT_EQ(cancel->command.id, NumberedId(2));
}

BridgeConfig BridgeOf(const SigningKey& key) {
  BridgeConfig bridge = UnsignedBridge();  // which a key overrules
  bridge.bridge.public_key = key.public_key();
  return bridge;
}

class SignedOrderTest : public testing::Test {
 protected:
  std::size_t Answers() const { return sink_.All<driver_status_t>("DRIVER_STATUS/b0").size(); }
  driver_order_t Bump(std::uint32_t number) {
    return OrderMessage(kBoot, ++epoch_, NumberedId(number), "axis1", "bump");
  }

  FakeClock clock_;
  MemorySink sink_;
  std::int64_t epoch_ = 0;
  SigningKey bridge_key_ = SigningKey::Generate();
  SigningKey driver_key_ = SigningKey::Generate();
  BusConfig bus_ = CountingBus("b0", {"axis1"});
  DriverCommandServer server_{
      bus_, BridgeOf(bridge_key_), {{.boot_id = kBoot}, &clock_, &sink_, [] {}, &driver_key_}};
};

TEST_F(SignedOrderTest, OnlyTheBridgesOwnOrdersActOrAreAnswered) {
  const SigningKey stranger = SigningKey::Generate();
  server_.OnDriverCommand(Enveloped(Bump(1)));
  server_.OnDriverCommand(Enveloped(Bump(2), &stranger));
  driver_order_t query = Bump(3);
  query.kind = driver_order_t::KIND_QUERY;
  server_.OnDriverCommand(Enveloped(query, &driver_key_));
  EXPECT_EQ(Answers(), 0u);
  EXPECT_EQ(server_.refused(), 3);
  EXPECT_FALSE(server_.Take());
  server_.OnDriverCommand(Enveloped(Bump(4), &bridge_key_));
  EXPECT_EQ(Answers(), 1u);
  EXPECT_TRUE(server_.Take());
  EXPECT_EQ(server_.refused(), 3);
}

TEST_F(SignedOrderTest, AForgedOrderDoesNotMoveTheFence) {
  driver_order_t forged = Bump(1);
  forged.bridge_boot_id = 4711;
  forged.bridge_epoch = INT64_MAX;
  server_.OnDriverCommand(Enveloped(forged));
  server_.OnDriverCommand(Enveloped(Bump(2), &bridge_key_));
  EXPECT_EQ(sink_.All<driver_status_t>("DRIVER_STATUS/b0").back().state, S::STATE_ROUTED);
}

TEST_F(SignedOrderTest, ASignatureForSomethingElseIsNone) {
  driver_command_t envelope{};
  envelope.order = Encoded(Bump(1));
  envelope.order_size = static_cast<std::int16_t>(envelope.order.size());
  for (const Domain domain : {Domain::kCommand, Domain::kStatus, Domain::kDriver, Domain::kPermit}) {
    const Signature signature = bridge_key_.Sign(domain, envelope.order);
    std::copy(signature.begin(), signature.end(), std::begin(envelope.sig));
    server_.OnDriverCommand(Encoded(envelope));
  }
  EXPECT_EQ(server_.refused(), 4);
  EXPECT_EQ(Answers(), 0u);
}

TEST_F(SignedOrderTest, OneForAnotherBootIsNotCountedAndWhatCannotBeDecodedIs) {
  driver_order_t order = Bump(1);
  order.driver_boot_id = kBoot + 1;
  server_.OnDriverCommand(Enveloped(order, &bridge_key_));
  EXPECT_EQ(server_.refused(), 0);
  std::vector<std::uint8_t> bytes = Enveloped(Bump(1), &bridge_key_);
  bytes.pop_back();
  server_.OnDriverCommand(bytes);
  order = Bump(1);
  order.kind = 9;
  server_.OnDriverCommand(Enveloped(order, &bridge_key_));
  EXPECT_EQ(server_.refused(), 2);
}

TEST_F(SignedOrderTest, EveryStatusIsSigned) {
  server_.OnDriverCommand(Enveloped(Bump(1), &bridge_key_));
  ASSERT_TRUE(server_.Take());
  server_.Report("axis1", NumberedId(1), {.state = CommandState::kSucceeded, .text = "bumped"}, 3, 2);
  server_.Hello({});
  server_.Goodbye();
  const auto all = sink_.All<driver_status_t>("DRIVER_STATUS/b0");
  ASSERT_EQ(all.size(), 5u);
  for (driver_status_t status : all) {
    EXPECT_TRUE(VerifyMessage(driver_key_.public_key(), Domain::kDriver, status));
    status.seq += 1;
    EXPECT_FALSE(VerifyMessage(driver_key_.public_key(), Domain::kDriver, status));
  }
  EXPECT_EQ(all[2].nv_writes, 2);
}

TEST(UnsignedOrders, AreRefusedWhereTheFileSaysNothing) {
  FakeClock clock;
  MemorySink sink;
  const BusConfig bus = CountingBus("b0", {"axis1"});
  DriverCommandServer server(bus, {}, {{.boot_id = kBoot}, &clock, &sink, [] {}});
  server.OnDriverCommand(Enveloped(OrderMessage(kBoot, 1, NumberedId(1), "axis1", "bump")));
  EXPECT_EQ(server.refused(), 1);
  EXPECT_TRUE(sink.All<driver_status_t>("DRIVER_STATUS/b0").empty());
  EXPECT_NE(server.Rule().find("bridge.unsigned_commands: allow"), std::string_view::npos);
}

// To be run under -fsanitize=thread as well. Forged orders and permits come as fast as they can be verified; true
// ones among them are each done once.
TEST(OrderFlood, TrueOrdersAmongForgedOnes) {
  struct Sink final : MessageSink {
    void Publish(const std::string&, Bytes) override {}
  } sink;
  FakeClock clock;
  const SigningKey bridge_key = SigningKey::Generate();
  const SigningKey stranger = SigningKey::Generate();
  const BusConfig bus = CountingBus("b0", {"axis1"});
  DriverCommandServer server(bus, BridgeOf(bridge_key), {{.boot_id = kBoot}, &clock, &sink, [] {}});
  constexpr std::uint32_t kOrders = 100;
  constexpr int kForgedPerOrder = 20;
  std::vector<std::vector<std::uint8_t>> forged;
  std::vector<std::vector<std::uint8_t>> genuine;
  for (std::uint32_t i = 0; i < kOrders; ++i) {
    const driver_order_t order = OrderMessage(kBoot, i + 1, NumberedId(i), "axis1", "bump");
    forged.push_back(Enveloped(order, &stranger));
    genuine.push_back(Enveloped(order, &bridge_key));
  }
  std::atomic<bool> flooding = true;
  std::atomic<std::uint32_t> done = 0;
  std::thread command_thread([&] {
    for (std::uint32_t i = 0; i < kOrders; ++i) {
      for (int n = 0; n < kForgedPerOrder; ++n) server.OnDriverCommand(forged[i]);
      server.OnPermit("axis1", forged[i]);
      while (done + DriverCommandServer::kMaxWaiting <= i)
        std::this_thread::yield();  // as a bridge: its queue is not full
      server.OnDriverCommand(genuine[i]);
    }
    flooding = false;
  });
  driver_device_t summary{};
  summary.device = "axis1";
  while (true) {
    const bool last_round = !flooding;
    const auto taken = server.Take();
    static_cast<void>(server.CheckPermit("axis1", "bump"));
    if (taken) {
      server.Report(taken->device, taken->command.id, {.state = CommandState::kSucceeded}, -1);
      server.Hello({&summary, 1});
      ++done;
    } else if (last_round) {
      break;
    }
  }
  command_thread.join();
  EXPECT_EQ(done, kOrders);
  EXPECT_EQ(server.refused(), std::int64_t{kOrders} * kForgedPerOrder);
}

}  // namespace
}  // namespace axlecast
