#include "client/command/permit_slot.h"

#include <gtest/gtest.h>

#include <thread>

namespace axlecast {
namespace {

using Asked = PermitSlot::Asked;

TEST(NewestValue, TheReaderGetsTheNewestOnce) {
  NewestValue<int> value;
  EXPECT_FALSE(value.Take());
  for (const int number : {1, 2, 3}) {
    value.back() = number;
    value.Publish();
  }
  ASSERT_TRUE(value.Take());
  EXPECT_EQ(value.front(), 3);
  EXPECT_FALSE(value.Take());
  EXPECT_EQ(value.front(), 3);
  value.back() = 4;
  EXPECT_EQ(value.front(), 3) << "the writer fills another one";
}

// The thread sanitizer checks the accesses.
TEST(NewestValue, AWriterAndAReaderRunTogether) {
  constexpr std::int64_t kLast = 100'000;
  NewestValue<std::array<std::int64_t, 8>> value;
  std::thread writer([&value] {
    for (std::int64_t number = 1; number <= kLast; ++number) {
      value.back().fill(number);
      value.Publish();
    }
  });
  std::int64_t newest = 0;
  while (newest < kLast) {
    if (!value.Take()) continue;
    const auto& taken = value.front();
    ASSERT_GT(taken[0], newest);
    newest = taken[0];
    for (const std::int64_t number : taken) ASSERT_EQ(number, newest);
  }
  writer.join();
}

class PermitSlotTest : public testing::Test {
 protected:
  static PermitInstant At(MonoNs mono) { return {mono, 1'000'000 + mono / kMicrosecond, {}}; }
  Asked Allow(MonoNs now, const std::vector<std::string>& operations = {"zero"}, std::int32_t valid_ms = 200) {
    return slot_.Allow(operations, valid_ms, At(now), issue_);
  }
  // The instant of the call that is sent at `now`; -1: nothing is sent.
  MonoNs Sent(MonoNs now) {
    const PermitSlot::Step step = slot_.Next(now);
    next_ = step.next;
    return step.send == nullptr ? -1 : step.send->called.mono;
  }

  static constexpr MonoNs kMs = kMillisecond;
  PermitSlot slot_{"axis1"};
  std::atomic<std::int64_t> issue_ = 0;
  MonoNs next_ = 0;
};

TEST_F(PermitSlotTest, ALoopOfAKilohertzWakesTheThreadOnce) {
  int woken = 0;
  std::vector<MonoNs> sent;
  MonoNs look = kNever;
  for (MonoNs now = 0; now < kSecond; now += kMs) {
    const Asked asked = Allow(now);
    woken += asked == Asked::kWake ? 1 : 0;
    if (asked != Asked::kWake && now < look) continue;
    const MonoNs called = Sent(now);
    if (called >= 0) sent.push_back(called);
    look = next_;
  }
  EXPECT_EQ(woken, 1);
  ASSERT_EQ(sent.size(), 20U) << "every quarter of 200 ms";
  for (std::size_t i = 0; i < sent.size(); ++i)
    EXPECT_EQ(sent[i], static_cast<MonoNs>(i) * 50 * kMs) << "the newest call";
}

TEST_F(PermitSlotTest, WithoutFurtherCallsNothingIsRenewed) {
  Allow(0);
  EXPECT_EQ(Sent(0), 0);
  Allow(10 * kMs);
  EXPECT_EQ(Sent(10 * kMs), -1);
  EXPECT_EQ(next_, 50 * kMs);
  EXPECT_EQ(Sent(50 * kMs), 10 * kMs) << "the last call counts, from its own instant";
  EXPECT_EQ(Sent(100 * kMs), -1);
  EXPECT_EQ(next_, kNever);
  EXPECT_EQ(Sent(kSecond), -1);
  EXPECT_EQ(Allow(2 * kSecond), Asked::kWake);
  EXPECT_EQ(Sent(2 * kSecond), 2 * kSecond);
}

TEST_F(PermitSlotTest, APermitEndsAfterTheCallAndNotAfterTheSending) {
  PermitRequest request;
  request.valid_ms = 200;
  request.called = At(kSecond);
  EXPECT_EQ(RemainingMs(request, kSecond), 200);
  EXPECT_EQ(RemainingMs(request, kSecond + 1), 200) << "rounded up";
  EXPECT_EQ(RemainingMs(request, kSecond + 50 * kMs), 150);
  EXPECT_EQ(RemainingMs(request, kSecond + 200 * kMs - 1), 1);
  EXPECT_EQ(RemainingMs(request, kSecond + 200 * kMs), 0);
  EXPECT_EQ(RemainingMs(request, 2 * kSecond), 0);
}

TEST_F(PermitSlotTest, AChangeIsSentAtOnce) {
  Allow(0);
  EXPECT_EQ(Sent(0), 0);
  EXPECT_EQ(Allow(kMs, {"zero", "reset"}), Asked::kWake);
  EXPECT_EQ(Sent(kMs), kMs);
  EXPECT_EQ(Allow(2 * kMs, {"zero", "reset"}, 100), Asked::kWake);
  EXPECT_EQ(Sent(2 * kMs), 2 * kMs);
  EXPECT_EQ(next_, 27 * kMs);
  EXPECT_EQ(Allow(3 * kMs, {"zero", "reset"}, 100), Asked::kStored);
}

TEST_F(PermitSlotTest, WhatIsWithdrawnIsNeverSentLater) {
  Allow(0);
  EXPECT_EQ(Sent(0), 0);
  Allow(kMs);
  const auto withdrawal = slot_.Withdraw(At(2 * kMs), issue_);
  ASSERT_TRUE(withdrawal);
  EXPECT_TRUE(withdrawal->operations.empty());
  EXPECT_EQ(withdrawal->issue, 3);
  EXPECT_EQ(Sent(50 * kMs), -1);
  EXPECT_FALSE(slot_.Withdraw(At(3 * kMs), issue_)) << "nothing was allowed since";
  EXPECT_EQ(Allow(60 * kMs), Asked::kWake) << "as it was before the withdrawal, but it holds no more";
  EXPECT_EQ(Sent(60 * kMs), 60 * kMs);
}

TEST_F(PermitSlotTest, WhatTheThreadHasTakenIsOlderThanTheWithdrawal) {
  Allow(0);
  const PermitSlot::Step step = slot_.Next(0);
  ASSERT_NE(step.send, nullptr);
  const auto withdrawal = slot_.Withdraw(At(kMs), issue_);
  ASSERT_TRUE(withdrawal);
  EXPECT_LT(step.send->issue, withdrawal->issue);
  EXPECT_TRUE(slot_.IsWithdrawn(*step.send));
  Allow(2 * kMs);
  EXPECT_EQ(Sent(2 * kMs), 2 * kMs) << "allowed again";
}

TEST_F(PermitSlotTest, AWithdrawalIsSentAlthoughAnotherCallerHasWithdrawnMeanwhile) {
  Allow(0);
  const auto first = slot_.Withdraw(At(kMs), issue_);
  Allow(2 * kMs);
  const auto second = slot_.Withdraw(At(3 * kMs), issue_);
  ASSERT_TRUE(first && second);
  EXPECT_FALSE(slot_.IsWithdrawn(*first)) << "its caller expects that it was sent";
  EXPECT_FALSE(slot_.IsWithdrawn(*second));
}

TEST_F(PermitSlotTest, WhatDoesNotFitReplacesNothing) {
  Allow(0);
  EXPECT_EQ(Allow(kMs, {""}), Asked::kRefused);
  EXPECT_EQ(Sent(kMs), 0);
}

}  // namespace
}  // namespace axlecast
