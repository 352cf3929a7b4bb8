#include <gtest/gtest.h>
#include <axlecast/device_info_t.hpp>

#include "tools/axlecast/device_data/replace_wizard.h"

namespace axlecast {
namespace {

using Stage = ExchangeWatch::Stage;

constexpr std::int8_t kOnline = device_info_t::STATE_ONLINE;
constexpr std::int8_t kDegraded = device_info_t::STATE_DEGRADED;
constexpr std::int8_t kOffline = device_info_t::STATE_OFFLINE;
constexpr std::int8_t kStarting = device_info_t::STATE_STARTING;

TEST(ExchangeWatch, AwayAndSteadilyBack) {
  ExchangeWatch watch;
  watch.On(kOnline, 7, 0);
  watch.On(kOnline, 7, 100 * kSecond);
  EXPECT_EQ(watch.stage(), Stage::kThere);
  watch.On(kOffline, 7, 101 * kSecond);
  EXPECT_EQ(watch.stage(), Stage::kAway);
  watch.On(kOnline, 7, 200 * kSecond);
  EXPECT_EQ(watch.stage(), Stage::kAway);
  watch.On(kDegraded, 7, 201 * kSecond);
  EXPECT_EQ(watch.stage(), Stage::kBack) << "a new one may have alarms";
}

TEST(ExchangeWatch, ABreakBeginsTheSecondAnew) {
  ExchangeWatch watch;
  watch.On(kOffline, 7, 0);
  watch.On(kOnline, 7, 10 * kSecond);
  watch.On(kStarting, 7, 10 * kSecond + kSecond / 2);
  watch.On(kOnline, 7, 11 * kSecond);
  watch.On(kOnline, 7, 12 * kSecond - 1);
  EXPECT_EQ(watch.stage(), Stage::kAway);
  watch.On(kOnline, 7, 12 * kSecond);
  EXPECT_EQ(watch.stage(), Stage::kBack);
}

TEST(ExchangeWatch, ASilentOrRestartedDriverWasAway) {
  ExchangeWatch silent;
  silent.On(kOnline, 7, 0);
  silent.On(std::nullopt, 0, kSecond);
  EXPECT_EQ(silent.stage(), Stage::kAway);
  ExchangeWatch restarted;
  restarted.On(kOnline, 7, 0);
  restarted.On(kOnline, 8, kSecond);
  EXPECT_EQ(restarted.stage(), Stage::kAway);
  restarted.On(kOnline, 8, 2 * kSecond);
  EXPECT_EQ(restarted.stage(), Stage::kBack);
}

}  // namespace

}  // namespace axlecast
