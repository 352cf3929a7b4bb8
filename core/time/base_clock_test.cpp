#include "core/time/base_clock.h"

#include <gtest/gtest.h>

#include <axlecast/time_quality_t.hpp>
#include <vector>

#include "core/messages/message.h"

namespace axlecast {
namespace {

constexpr std::int64_t kOwn = 77;

time_quality_t Quality(MonoNs mono) {
  time_quality_t quality{};
  quality.clock_id = kOwn;
  quality.mono_ns = mono;
  quality.base_id = 5;
  quality.base_ns = mono + kSecond;
  quality.half_width_ns = 300;
  quality.growth_ppb = 1'000'000;  // 1 ms per second
  quality.valid_ms = 1'000;
  quality.grade = time_quality_t::GRADE_PROVEN;
  return quality;
}

class BaseClockTest : public ::testing::Test {
 protected:
  void Take(const time_quality_t& quality) { clock_.OnTime(Encoded(quality)); }

  BaseClock clock_{kOwn};
};

TEST_F(BaseClockTest, AClaimHoldsAroundItsInstantAndGrowsWiderWithTheDistance) {
  EXPECT_FALSE(clock_.At(kSecond));
  Take(Quality(kSecond));
  ASSERT_TRUE(clock_.At(kSecond));
  EXPECT_EQ(clock_.At(kSecond)->base_id, 5);
  EXPECT_EQ(clock_.At(kSecond)->base_ns, 2 * kSecond);
  const auto later = clock_.At(kSecond + 100 * kMillisecond);
  ASSERT_TRUE(later);
  EXPECT_EQ(later->base_ns, 2 * kSecond + 100 * kMillisecond);
  EXPECT_GE(later->half_width_ns, 300 + 100 * kMicrosecond);
  EXPECT_LE(later->half_width_ns, 310 + 101 * kMicrosecond);
  EXPECT_TRUE(clock_.At(kSecond - 100 * kMillisecond));
  EXPECT_FALSE(clock_.At(kSecond + 1'001 * kMillisecond)) << "the process that claims may have ended";
  EXPECT_FALSE(clock_.At(-1));
}

TEST_F(BaseClockTest, AMessageWithoutAClaimEndsTheClaim) {
  Take(Quality(kSecond));
  time_quality_t none = Quality(2 * kSecond);
  none.half_width_ns = -1;
  Take(none);
  EXPECT_FALSE(clock_.At(2 * kSecond));
}

TEST_F(BaseClockTest, OtherClocksAndOtherBytesAreIgnored) {
  time_quality_t other = Quality(kSecond);
  other.clock_id = kOwn + 1;
  Take(other);
  EXPECT_FALSE(clock_.At(kSecond));
  clock_.OnTime(std::vector<std::uint8_t>{1, 2, 3});
  EXPECT_FALSE(clock_.At(kSecond));
  BaseClock unknown(0);
  other.clock_id = 0;
  unknown.OnTime(Encoded(other));
  EXPECT_FALSE(unknown.At(kSecond)) << "two hosts without an id would be taken for one";
}

TEST_F(BaseClockTest, AnAbsurdMessageIsNoClaim) {
  const auto claims = [&](auto change) {
    time_quality_t quality = Quality(kSecond);
    change(quality);
    Take(quality);
    return clock_.At(kSecond).has_value();
  };
  EXPECT_TRUE(claims([](time_quality_t&) {}));
  EXPECT_FALSE(claims([](time_quality_t& quality) { quality.grade = time_quality_t::GRADE_CLAIMED; }));
  EXPECT_FALSE(claims([](time_quality_t& quality) { quality.base_id = 0; }));
  EXPECT_FALSE(claims([](time_quality_t& quality) { quality.base_ns = INT64_MAX; }));
  EXPECT_FALSE(claims([](time_quality_t& quality) { quality.growth_ppb = -1; }));
  EXPECT_FALSE(claims([](time_quality_t& quality) { quality.half_width_ns = INT64_MAX; }));
  EXPECT_TRUE(claims([](time_quality_t& quality) { quality.valid_ms = -5; })) << "at its own instant only";
  EXPECT_FALSE(clock_.At(kSecond + 1));
}

}  // namespace
}  // namespace axlecast
