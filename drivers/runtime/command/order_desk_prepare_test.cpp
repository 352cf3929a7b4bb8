#include <gtest/gtest.h>

#include <axlecast/command_status_t.hpp>
#include <axlecast/driver_status_t.hpp>

#include "drivers/runtime/command/driver_command_server.h"
#include "tests/support/counting_family.h"
#include "tests/support/fake_clock.h"
#include "tests/support/memory_sink.h"

namespace axlecast {
namespace {

using S = command_status_t;

constexpr std::int64_t kBoot = 5;

class PrepareTest : public testing::Test {
 protected:
  driver_status_t Send(std::uint32_t number, std::int8_t kind = driver_order_t::KIND_PREPARE,
                       const std::string& operation = "bump") {
    driver_order_t order = OrderMessage(kBoot, ++epoch_, NumberedId(number), "axis1", operation);
    order.kind = kind;
    desk_.OnDriverCommand(Enveloped(order));
    return Last();
  }
  driver_status_t Last() const { return sink_.All<driver_status_t>("DRIVER_STATUS/b0").back(); }

  FakeClock clock_;
  MemorySink sink_;
  int woken_ = 0;
  std::int64_t epoch_ = 0;
  BusConfig bus_ = CountingBus("b0", {"axis1", "axis2"});
  DriverCommandServer desk_{bus_, UnsignedBridge(), {kBoot, &clock_, &sink_, [this] { ++woken_; }}};
};

TEST_F(PrepareTest, IsJudgedOnTheBussThreadAndNeverTaken) {
  EXPECT_EQ(Send(1).state, S::STATE_ROUTED);
  EXPECT_EQ(woken_, 1);
  EXPECT_FALSE(desk_.Take());
  const auto asked = desk_.TakePrepare();
  ASSERT_TRUE(asked);
  EXPECT_EQ(asked->device, "axis1");
  EXPECT_EQ(asked->order.operation, "bump");
  EXPECT_FALSE(desk_.TakePrepare());
  desk_.ReportPrepared(NumberedId(1),
                       {.state = CommandState::kSucceeded, .text = "would", .changes = {{"position", "1", ""}}}, 4);
  EXPECT_EQ(Last().state, S::STATE_SUCCEEDED);
  EXPECT_EQ(Last().verified, 0);
  EXPECT_EQ(Last().text, "would");
  EXPECT_EQ(Last().epoch_after, 4);
  EXPECT_EQ(Last().changes.at(0).key, "position");
  EXPECT_EQ(Send(1).text, "would");  // repeated
  EXPECT_EQ(Send(1, driver_order_t::KIND_QUERY).text, "would");
  EXPECT_FALSE(desk_.TakePrepare());
}

TEST_F(PrepareTest, DoesNotWaitForWhatItsDeviceWorksOn) {
  Send(1, driver_order_t::KIND_EXECUTE);
  ASSERT_TRUE(desk_.Take());
  Send(2);
  EXPECT_TRUE(desk_.TakePrepare());
}

TEST_F(PrepareTest, ItsIdIsOfNoUseForExecute) {
  Send(1);
  ASSERT_TRUE(desk_.TakePrepare());
  desk_.ReportPrepared(NumberedId(1), {.state = CommandState::kSucceeded}, 0);
  EXPECT_EQ(Send(1, driver_order_t::KIND_EXECUTE).reason_code, S::REASON_ID_REUSED);
  EXPECT_EQ(Last().state, S::STATE_REJECTED);
  Send(2, driver_order_t::KIND_EXECUTE);
  EXPECT_EQ(Send(2).reason_code, S::REASON_ID_REUSED);
  EXPECT_EQ(desk_.Take()->order.id, NumberedId(2));
}

TEST_F(PrepareTest, RefusesWhatExecuteWouldRefuse) {
  EXPECT_EQ(Send(1, driver_order_t::KIND_PREPARE, "explode").reason_code, S::REASON_UNKNOWN_OPERATION);
  EXPECT_EQ(Send(2, driver_order_t::KIND_PREPARE, "write").reason_code, S::REASON_BAD_ARGUMENT);
  EXPECT_EQ(Send(3, driver_order_t::KIND_PREPARE, "undo_datum").reason_code, S::REASON_UNKNOWN_OPERATION);
  EXPECT_EQ(Last().text, "the bridge carries it out itself, no driver does: send it to the bridge");
  for (std::uint32_t i = 0; i < DriverCommandServer::kMaxWaiting; ++i)
    EXPECT_EQ(Send(10 + i).state, S::STATE_ROUTED);
  EXPECT_EQ(Send(99).reason_code, S::REASON_QUEUE_FULL);
}

TEST_F(PrepareTest, IsFencedByItsEpoch) {
  Send(1);
  epoch_ -= 1;
  EXPECT_EQ(Send(2).state, S::STATE_UNKNOWN);
  EXPECT_EQ(Last().reason_code, S::REASON_FENCED);
  EXPECT_EQ(desk_.TakePrepare()->order.id, NumberedId(1));
  EXPECT_FALSE(desk_.TakePrepare());
}

TEST_F(PrepareTest, EndsAlsoWhenNobodyJudges) {
  Send(1);
  EXPECT_EQ(Send(1, driver_order_t::KIND_CANCEL).state, S::STATE_CANCELLED);
  Send(2);
  clock_.Advance(kSecond + 1);
  EXPECT_FALSE(desk_.TakePrepare());
  EXPECT_EQ(Last().state, S::STATE_EXPIRED);
  Send(3);
  desk_.Goodbye();
  EXPECT_EQ(sink_.All<driver_status_t>("DRIVER_STATUS/b0").end()[-2].reason_code, S::REASON_STOPPING);
  EXPECT_FALSE(desk_.TakePrepare());
  desk_.ReportPrepared(NumberedId(3), {.state = CommandState::kSucceeded}, 0);
  EXPECT_EQ(Last().kind, driver_status_t::KIND_GOODBYE);
}

}  // namespace
}  // namespace axlecast
