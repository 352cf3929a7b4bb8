#include "tools/fleet/ship/ship_plan.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <vector>

namespace axlecast {
namespace {

using ::testing::Eq;
using ::testing::Optional;

constexpr MonoNs kNow = 1'000 * kSecond;
constexpr std::int64_t kBatch = 8 << 20;

TEST(TokenBucket, KeepsTheAverage) {
  TokenBucket bucket(1'000'000);
  MonoNs now = kNow;
  std::int64_t taken = 0;
  while (now < kNow + 100 * kSecond) {
    now = bucket.NextAt(now);
    bucket.Take(kBatch, now);
    taken += kBatch;
  }
  EXPECT_NEAR(static_cast<double>(taken), 101e6, 2.0 * kBatch);
}

TEST(TokenBucket, DoesNotSaveMoreThanOneSecond) {
  TokenBucket bucket(1'000);
  bucket.Take(1'000, kNow);
  EXPECT_GT(bucket.NextAt(kNow), kNow);
  const MonoNs later = kNow + 3'600 * kSecond;
  EXPECT_EQ(bucket.NextAt(later), later);
  bucket.Take(1'500, later);
  EXPECT_NEAR(static_cast<double>(bucket.NextAt(later) - later), 0.501e9, 2e6);
}

TEST(TokenBucket, HasNoLimitWithoutARate) {
  TokenBucket bucket(0);
  bucket.Take(1LL << 60, kNow);
  EXPECT_EQ(bucket.NextAt(kNow), kNow);
}

TEST(TokenBucket, PaysItsDebtInSmallSteps) {
  TokenBucket bucket(100);  // a byte in 10 ms
  bucket.Take(200, kNow);
  MonoNs now = kNow;
  while (bucket.NextAt(now) > now) now += kMillisecond;
  EXPECT_NEAR(static_cast<double>(now - kNow), 1.01e9, 0.05e9);
}

std::vector<WaitingLog> Logs() {
  return {{.start_utime = 1, .live = false, .waiting = 100, .more = false, .shipped_at = 0},
          {.start_utime = 2, .live = false, .waiting = 100, .more = false, .shipped_at = 0},
          {.start_utime = 3, .live = false, .waiting = 0, .more = false, .shipped_at = 0},
          {.start_utime = 4, .live = true, .waiting = 100, .more = false, .shipped_at = kNow - kSecond},
          {.start_utime = 5, .live = true, .waiting = 100, .more = false, .shipped_at = kNow - 2 * kSecond}};
}

TEST(ShipPlan, BeginsWithTheLogsThatAreBeingWritten) {
  ShipPlan plan(true, 0);
  std::vector<WaitingLog> logs = Logs();
  EXPECT_THAT(plan.Next(logs, kNow), Optional(Eq(4U)));
  logs[4].shipped_at = kNow;
  EXPECT_THAT(plan.Next(logs, kNow), Optional(Eq(3U)));
  logs[3].shipped_at = kNow;
  EXPECT_THAT(plan.Next(logs, kNow), Optional(Eq(1U))) << "the newest of the others";
  EXPECT_THAT(ShipPlan(false, 0).Next(logs, kNow), Optional(Eq(0U)));
  EXPECT_THAT(plan.Next(logs, kNow + kSecond), Optional(Eq(3U)));
}

TEST(ShipPlan, LimitsOnlyTheOthers) {
  ShipPlan plan(true, 1'000);
  std::vector<WaitingLog> logs = Logs();
  plan.Shipped(logs[1], 3'000, kNow);
  logs[3].shipped_at = logs[4].shipped_at = kNow;
  EXPECT_EQ(plan.Next(logs, kNow), std::nullopt);
  EXPECT_EQ(plan.NextAt(logs, kNow), kNow + ShipPlan::kLiveInterval) << "the live ones";
  logs[4].more = true;
  EXPECT_THAT(plan.Next(logs, kNow), Optional(Eq(4U))) << "its last batch was full";
  logs[4].more = false;
  logs[3].waiting = logs[4].waiting = 0;
  EXPECT_NEAR(static_cast<double>(plan.NextAt(logs, kNow) - kNow), 2e9, 1e7);
  EXPECT_THAT(plan.Next(logs, plan.NextAt(logs, kNow)), Optional(Eq(1U)));
  plan.Shipped(Logs()[3], 1LL << 50, kNow);
  EXPECT_THAT(plan.Next(logs, kNow + 3 * kSecond), Optional(Eq(1U)));
}

TEST(ShipPlan, WaitsWhileNothingIsThere) {
  ShipPlan plan(true, 0);
  std::vector<WaitingLog> logs = Logs();
  for (WaitingLog& log : logs) log.waiting = 0;
  EXPECT_EQ(plan.Next(logs, kNow), std::nullopt);
  EXPECT_EQ(plan.NextAt(logs, kNow), kNever);
  EXPECT_EQ(plan.Next({}, kNow), std::nullopt);
}

}  // namespace
}  // namespace axlecast
