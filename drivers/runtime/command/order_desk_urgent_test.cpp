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

class UrgentOrderTest : public testing::Test {
 protected:
  void Send(std::uint32_t number, const std::string& operation, const std::string& device = "axis1",
            std::int8_t kind = driver_order_t::KIND_EXECUTE) {
    driver_order_t order = OrderMessage(kBoot, ++epoch_, NumberedId(number), device, operation);
    order.kind = kind;
    desk_.OnDriverCommand(Enveloped(order));
  }
  std::string Taken() {
    const auto taken = desk_.Take();
    return taken ? taken->device + ' ' + taken->order.operation : "";
  }
  std::int8_t LastState() const { return sink_.All<driver_status_t>("DRIVER_STATUS/b0").back().state; }

  FakeClock clock_;
  MemorySink sink_;
  std::int64_t epoch_ = 0;
  BusConfig bus_ = CountingBus("b0", {"axis1", "axis2"});
  DriverCommandServer desk_{bus_, UnsignedBridge(), {kBoot, &clock_, &sink_, [] {}}};
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
  desk_.Report("axis1", NumberedId(2), {.state = CommandState::kSucceeded, .verified = true}, 0);
  EXPECT_EQ(LastState(), S::STATE_SUCCEEDED);
  desk_.Report("axis1", NumberedId(1), {.state = CommandState::kFailed}, 0);
  EXPECT_EQ(LastState(), S::STATE_FAILED);
}

TEST_F(UrgentOrderTest, OneAtATimeToo) {
  Send(1, "halt");
  Send(2, "halt");
  EXPECT_EQ(Taken(), "axis1 halt");
  EXPECT_EQ(Taken(), "");
  desk_.Report("axis1", NumberedId(1), {.state = CommandState::kSucceeded}, 0);
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
  const auto cancel = desk_.TakeCancel();
  ASSERT_TRUE(cancel);
  EXPECT_EQ(cancel->order.id, NumberedId(2));
}

}  // namespace
}  // namespace axlecast
