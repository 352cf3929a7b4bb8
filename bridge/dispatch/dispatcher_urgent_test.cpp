#include "bridge/dispatch/dispatcher_fixture.h"

namespace axlecast {
namespace {

using UrgentCommandTest = DispatcherTest;

std::vector<std::string> Operations(const std::vector<driver_order_t>& orders) {
  std::vector<std::string> names;
  for (const driver_order_t& order : orders) {
    if (names.empty() || names.back() != order.operation) names.push_back(order.operation);
  }
  return names;
}

TEST_F(UrgentCommandTest, IsRoutedWhileAnotherCommandIsUnderWay) {
  Send(Body(1));
  Report(Orders().back(), S::STATE_RUNNING);
  Send(Body(2, "halt"));
  EXPECT_EQ(Operations(Orders()), (std::vector<std::string>{"bump", "halt"}));
  const driver_order_t halt = Orders().back();
  Report(halt, S::STATE_SUCCEEDED);
  EXPECT_EQ(Last().operation, "halt");
  EXPECT_EQ(Last().state, S::STATE_SUCCEEDED);
  EXPECT_EQ(Last().is_final, 1);
}

TEST_F(UrgentCommandTest, IsCancelledInItsOwnLane) {
  Send(Body(1));
  Send(Body(2, "halt"));
  SendAs(Body(2, "halt"), command_body_t::MODE_CANCEL);
  EXPECT_EQ(Orders().back().kind, driver_order_t::KIND_CANCEL);
  EXPECT_EQ(Orders().back().operation, "halt");
}

}  // namespace
}  // namespace axlecast
