#include "drivers/runtime/process/driver.h"

#include <gtest/gtest.h>

namespace axlecast {
namespace {

TEST(UnauthorizedCommandCounter, IsThereAtOnceAndChangesAtMostEvery10Seconds) {
  UnauthorizedCommandCounter watch;
  MonoNs now = 1'000 * kSecond;
  EXPECT_FALSE(watch.Update(0, now));
  EXPECT_TRUE(watch.Update(1, now));
  EXPECT_TRUE(watch.present());
  EXPECT_FALSE(watch.Update(2, now + 9 * kSecond));
  EXPECT_FALSE(watch.Update(2, now + 10 * kSecond));  // one more had come
  EXPECT_TRUE(watch.present());
  EXPECT_TRUE(watch.Update(2, now + 20 * kSecond));
  EXPECT_FALSE(watch.present());
  EXPECT_FALSE(watch.Update(3, now + 29 * kSecond));
  EXPECT_TRUE(watch.Update(3, now + 30 * kSecond));
  int changes = 0;
  for (int second = 31; second < 131; ++second) {
    changes += watch.Update(second % 12 == 0 ? second : 3, now + second * kSecond) ? 1 : 0;
  }
  EXPECT_LE(changes, 10);
}

}  // namespace
}  // namespace axlecast
