#include "tests/mutation/sample/limited.h"

#include <gtest/gtest.h>

namespace axlecast {
namespace {

TEST(Limited, KeepsTheValueWithinItsLimits) {
  bool limited = false;
  EXPECT_EQ(Limited(5, 2, 8, limited), 5);
  EXPECT_FALSE(limited);
  EXPECT_EQ(Limited(1, 2, 8, limited), 2);
  EXPECT_TRUE(limited);
  EXPECT_EQ(Limited(9, 2, 8, limited), 8);
  EXPECT_TRUE(limited);
  EXPECT_EQ(Limited(2, 2, 8, limited), 2);
  EXPECT_FALSE(limited);
  EXPECT_EQ(Limited(8, 2, 8, limited), 8);
#ifndef AXLECAST_WITHOUT_ASSERTION  // test_mutation.py removes it: the mutant `value >= maximum` survives
  EXPECT_FALSE(limited);
#endif
}

}  // namespace
}  // namespace axlecast
