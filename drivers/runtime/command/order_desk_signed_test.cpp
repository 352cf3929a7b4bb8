#include <gtest/gtest.h>

#include <atomic>
#include <axlecast/command_status_t.hpp>
#include <axlecast/driver_status_t.hpp>
#include <thread>

#include "drivers/runtime/command/driver_command_server.h"
#include "tests/support/counting_family.h"
#include "tests/support/fake_clock.h"
#include "tests/support/memory_sink.h"

namespace axlecast {
namespace {

using S = command_status_t;

constexpr std::int64_t kBoot = 5;

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
  DriverCommandServer desk_{bus_, BridgeOf(bridge_key_), {kBoot, &clock_, &sink_, [] {}, &driver_key_}};
};

TEST_F(SignedOrderTest, OnlyTheBridgesOwnOrdersActOrAreAnswered) {
  const SigningKey stranger = SigningKey::Generate();
  desk_.OnDriverCommand(Enveloped(Bump(1)));
  desk_.OnDriverCommand(Enveloped(Bump(2), &stranger));
  driver_order_t query = Bump(3);
  query.kind = driver_order_t::KIND_QUERY;
  desk_.OnDriverCommand(Enveloped(query, &driver_key_));
  EXPECT_EQ(Answers(), 0u);
  EXPECT_EQ(desk_.refused(), 3);
  EXPECT_FALSE(desk_.Take());
  desk_.OnDriverCommand(Enveloped(Bump(4), &bridge_key_));
  EXPECT_EQ(Answers(), 1u);
  EXPECT_TRUE(desk_.Take());
  EXPECT_EQ(desk_.refused(), 3);
}

TEST_F(SignedOrderTest, AForgedOrderDoesNotMoveTheFence) {
  driver_order_t forged = Bump(1);
  forged.bridge_boot_id = 4711;
  forged.bridge_epoch = INT64_MAX;
  desk_.OnDriverCommand(Enveloped(forged));
  desk_.OnDriverCommand(Enveloped(Bump(2), &bridge_key_));
  EXPECT_EQ(sink_.All<driver_status_t>("DRIVER_STATUS/b0").back().state, S::STATE_ROUTED);
}

TEST_F(SignedOrderTest, ASignatureForSomethingElseIsNone) {
  driver_command_t envelope{};
  envelope.order = Encoded(Bump(1));
  envelope.order_size = static_cast<std::int16_t>(envelope.order.size());
  for (const Domain domain : {Domain::kCommand, Domain::kStatus, Domain::kDriver, Domain::kPermit}) {
    const Signature signature = bridge_key_.Sign(domain, envelope.order);
    std::copy(signature.begin(), signature.end(), std::begin(envelope.sig));
    desk_.OnDriverCommand(Encoded(envelope));
  }
  EXPECT_EQ(desk_.refused(), 4);
  EXPECT_EQ(Answers(), 0u);
}

TEST_F(SignedOrderTest, OneForAnotherBootIsNotCountedAndWhatCannotBeDecodedIs) {
  driver_order_t order = Bump(1);
  order.driver_boot_id = kBoot + 1;
  desk_.OnDriverCommand(Enveloped(order, &bridge_key_));
  EXPECT_EQ(desk_.refused(), 0);
  std::vector<std::uint8_t> bytes = Enveloped(Bump(1), &bridge_key_);
  bytes.pop_back();
  desk_.OnDriverCommand(bytes);
  order = Bump(1);
  order.kind = 9;
  desk_.OnDriverCommand(Enveloped(order, &bridge_key_));
  EXPECT_EQ(desk_.refused(), 2);
}

TEST_F(SignedOrderTest, EveryStatusIsSigned) {
  desk_.OnDriverCommand(Enveloped(Bump(1), &bridge_key_));
  ASSERT_TRUE(desk_.Take());
  desk_.Report("axis1", NumberedId(1), {.state = CommandState::kSucceeded, .text = "bumped"}, 3, 2);
  desk_.Hello({});
  desk_.Goodbye();
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
  DriverCommandServer desk(bus, {}, {kBoot, &clock, &sink, [] {}});
  desk.OnDriverCommand(Enveloped(OrderMessage(kBoot, 1, NumberedId(1), "axis1", "bump")));
  EXPECT_EQ(desk.refused(), 1);
  EXPECT_TRUE(sink.All<driver_status_t>("DRIVER_STATUS/b0").empty());
  EXPECT_NE(desk.Rule().find("bridge.unsigned_commands: allow"), std::string_view::npos);
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
  DriverCommandServer desk(bus, BridgeOf(bridge_key), {kBoot, &clock, &sink, [] {}});
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
      for (int n = 0; n < kForgedPerOrder; ++n) desk.OnDriverCommand(forged[i]);
      desk.OnPermit("axis1", forged[i]);
      while (done + DriverCommandServer::kMaxWaiting <= i)
        std::this_thread::yield();  // as a bridge: its queue is not full
      desk.OnDriverCommand(genuine[i]);
    }
    flooding = false;
  });
  const DeviceSummary summary{.device = "axis1"};
  while (true) {
    const bool last_round = !flooding;
    const auto taken = desk.Take();
    static_cast<void>(desk.HasPermit("axis1", "bump"));
    if (taken) {
      desk.Report(taken->device, taken->order.id, {.state = CommandState::kSucceeded}, -1);
      desk.Hello({&summary, 1});
      ++done;
    } else if (last_round) {
      break;
    }
  }
  command_thread.join();
  EXPECT_EQ(done, kOrders);
  EXPECT_EQ(desk.refused(), std::int64_t{kOrders} * kForgedPerOrder);
}

}  // namespace
}  // namespace axlecast
