#include "drivers/runtime/command/driver_command_server.h"

#include <gtest/gtest.h>

#include <axlecast/command_status_t.hpp>

#include "tests/support/counting_family.h"
#include "tests/support/fake_clock.h"
#include "tests/support/memory_sink.h"

namespace axlecast {
namespace {

class OrderLedgerTest : public ::testing::Test {
 protected:
  static constexpr std::size_t kCapacity = 10;

  CommandStatusTable::Entry& Remember(std::uint32_t number) {
    return ledger_.Add(OrderMessage(1, number, NumberedId(number), "axis1", "zero"));
  }

  FakeClock clock_;
  MemorySink sink_;
  CommandStatusTable ledger_{"b0", Origin{.boot_id = 1}, clock_, {&sink_, nullptr}, kCapacity};
};

// Where orders may be unsigned, anybody may send ids without end.
TEST_F(OrderLedgerTest, ForgetsTheOldestFinishedOrder) {
  constexpr std::uint32_t kOrders = 5'000;
  for (std::uint32_t i = 0; i < kOrders; ++i) {
    ledger_.End(Remember(i), command_status_t::STATE_REJECTED, command_status_t::REASON_NOT_PERMITTED, "");
  }
  std::size_t known = 0;
  for (std::uint32_t i = 0; i < kOrders; ++i) known += ledger_.Find(NumberedId(i)) != nullptr ? 1U : 0U;
  EXPECT_EQ(known, kCapacity);
  EXPECT_NE(ledger_.Find(NumberedId(kOrders - 1)), nullptr);
}

TEST_F(OrderLedgerTest, AnOrderThatIsUnderWayIsNotForgotten) {
  Remember(0).status.state = command_status_t::STATE_RUNNING;
  for (std::uint32_t i = 1; i < 1'000; ++i) {
    ledger_.End(Remember(i), command_status_t::STATE_REJECTED, command_status_t::REASON_NOT_PERMITTED, "");
  }
  EXPECT_NE(ledger_.Find(NumberedId(0)), nullptr);
  EXPECT_EQ(ledger_.Find(NumberedId(1)), nullptr);
}

TEST_F(OrderLedgerTest, AnOrderThatWasUnderWayIsForgottenOnceItHasEnded) {
  CommandStatusTable::Entry& first = Remember(0);
  first.status.state = command_status_t::STATE_RUNNING;
  for (std::uint32_t i = 1; i < 2 * kCapacity; ++i) {
    ledger_.End(Remember(i), command_status_t::STATE_REJECTED, command_status_t::REASON_NOT_PERMITTED, "");
  }
  ledger_.End(first, command_status_t::STATE_FAILED, command_status_t::REASON_NONE, "");
  for (std::uint32_t i = 2 * kCapacity; i < 4 * kCapacity; ++i) {
    ledger_.End(Remember(i), command_status_t::STATE_REJECTED, command_status_t::REASON_NOT_PERMITTED, "");
  }
  EXPECT_EQ(ledger_.Find(NumberedId(0)), nullptr);
}

TEST_F(OrderLedgerTest, OrdersThatAreUnderWayExceedTheCapacity) {
  for (std::uint32_t i = 0; i <= kCapacity; ++i) Remember(i).status.state = command_status_t::STATE_RUNNING;
  for (std::uint32_t i = 0; i <= kCapacity; ++i) EXPECT_NE(ledger_.Find(NumberedId(i)), nullptr) << i;
}

TEST_F(OrderLedgerTest, AFinishedOrderIsForgottenAlsoIfItIsTheNewest) {
  for (std::uint32_t i = 1; i < kCapacity; ++i) Remember(i).status.state = command_status_t::STATE_RUNNING;
  ledger_.End(Remember(kCapacity), command_status_t::STATE_FAILED, command_status_t::REASON_NONE, "");
  Remember(kCapacity + 1);
  EXPECT_EQ(ledger_.Find(NumberedId(kCapacity)), nullptr);
}

TEST_F(OrderLedgerTest, AnOrderThatHasEndedKeepsItsStatusOnly) {
  CommandStatusTable::Entry& entry = Remember(1);
  entry.command.operation = "zero";
  entry.command.arguments = {{"value", "1"}};
  ledger_.End(entry, command_status_t::STATE_SUCCEEDED, command_status_t::REASON_NONE, "");
  EXPECT_EQ(entry.command.operation, "");
  EXPECT_TRUE(entry.command.arguments.empty());
}

}  // namespace
}  // namespace axlecast
