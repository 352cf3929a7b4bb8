// Tests of each kind that the check of product code judges: CMakeLists.txt states which of them must fail.
#include <gtest/gtest.h>

#include "tests/product_code/product.h"

namespace axlecast {
namespace {

TEST(Sample, RunsIt) { EXPECT_EQ(Doubled(2), 4); }

// Comes after a test that runs product code, and must not live on that.
TEST(Sample, OnlyComputes) { EXPECT_EQ(2 * 2, 4); }

TEST(Sample, IsSkipped) { GTEST_SKIP() << "on purpose"; }

class SampleFixture : public ::testing::Test {
 protected:
  const int four_ = Doubled(2);
};

TEST_F(SampleFixture, RunsItBeforeTheTestsBody) { EXPECT_EQ(four_, 4); }

}  // namespace
}  // namespace axlecast
