#include "drivers/runtime/axis/axis.h"

#include <gtest/gtest.h>

#include <axlecast/position_t.hpp>
#include <cmath>
#include <limits>
#include <numbers>

#include "drivers/runtime/axis/motion.h"
#include "drivers/runtime/axis/test_device.h"

namespace axlecast {
namespace {

constexpr std::int64_t kTurn = TestDevice::kTurn;

Scale Make(double per_turn, std::int64_t num, std::int64_t den, double modulo) {
  TestDevice device;
  device.config.per_turn = per_turn;
  device.config.ratio_num = num;
  device.config.ratio_den = den;
  device.config.modulo = modulo;
  return Scale(device.config);
}

TEST(Counts, NearestGoesTheShortWay) {
  EXPECT_EQ(Nearest(0, 360, 350), 360);
  EXPECT_EQ(Nearest(350, 360, 0), -10);
  EXPECT_EQ(Nearest(180, 360, 0), -180);  // half way round: [-180, 180)
  EXPECT_EQ(Nearest(5, 360, -725), -715);
  EXPECT_EQ(FloorMod(-1, 360), 359);
}

// The examples of docs/positions.md.
TEST(Scale, WorkedExamples) {
  const Scale screw = Make(5, 1, 1, 0);  // 5 mm per turn
  EXPECT_DOUBLE_EQ(screw.Value(10 * kTurn + kTurn / 2), 52.5);
  EXPECT_DOUBLE_EQ(screw.Value(-kTurn), -5);
  const Scale geared = Make(360, 1, 10, 360);  // a table behind a 10:1 gear, in degrees
  EXPECT_DOUBLE_EQ(geared.Value(10 * kTurn), 0);
  EXPECT_DOUBLE_EQ(geared.Value(25 * kTurn), 180);
  EXPECT_DOUBLE_EQ(geared.Value(-kTurn), 324);
}

TEST(Scale, AngleIsWithinOneTurn) {
  const Scale scale = Make(1, 1, 1, 0);
  EXPECT_DOUBLE_EQ(scale.AngleRad(0), 0);
  EXPECT_DOUBLE_EQ(scale.AngleRad(kTurn / 4), std::numbers::pi / 2);
  EXPECT_DOUBLE_EQ(scale.AngleRad(-kTurn / 4), 1.5 * std::numbers::pi);
  EXPECT_LT(scale.AngleRad(-1), 2 * std::numbers::pi);
}

TEST(Scale, ModuloIsExactHoweverFarTheAxisWent) {
  const Scale third = Make(360, 1, 3, 360);
  // 2^40 turns of a shaft behind 3:1 plus a quarter of the table's turn.
  const std::int64_t far = (INT64_C(1) << 40) / 3 * 3 * kTurn;
  EXPECT_DOUBLE_EQ(third.Value(far + 3 * kTurn / 4), 90);
  EXPECT_DOUBLE_EQ(third.Value(-far - 3 * kTurn / 4), 270);
  const Scale faster = Make(360, 7, 3, 360);
  EXPECT_NEAR(faster.Value(far + 1), 360.0 * 7 / 3 / kTurn, 1e-9);
}

TEST(Scale, ModuloThatIsNoWholeNumberOfCountsStillWraps) {
  const Scale odd = Make(1, 1, 1, std::numbers::pi);
  for (std::int64_t counts = -20 * kTurn; counts < 20 * kTurn; counts += 997) {
    const double value = odd.Value(counts);
    ASSERT_GE(value, 0);
    ASSERT_LT(value, std::numbers::pi);
  }
}

TEST(Scale, CountsOfAValue) {
  const Scale screw = Make(5, 1, 1, 0);
  EXPECT_EQ(screw.Counts(52.5), 10 * kTurn + kTurn / 2);
  EXPECT_EQ(screw.Counts(-5), -kTurn);
  EXPECT_EQ(screw.Counts(std::numeric_limits<double>::infinity()), std::nullopt);
  EXPECT_EQ(screw.Counts(1e15), std::nullopt);
}

TEST(Scale, TurnsMatterUnlessTheModuloDividesTheTurn) {
  EXPECT_TRUE(Make(5, 1, 1, 0).TurnsMatter());
  EXPECT_TRUE(Make(360, 1, 10, 360).TurnsMatter());
  EXPECT_FALSE(Make(360, 1, 1, 360).TurnsMatter());
  EXPECT_FALSE(Make(360, 3, 1, 120).TurnsMatter());
}

}  // namespace
}  // namespace axlecast
