#include "tools/monitor/trip_margins.h"

#include <gtest/gtest.h>

#include <cmath>
#include <iterator>

namespace axlecast {
namespace {

motor_health_t Motor() {
  motor_health_t motor{};
  motor.power_w = 250;
  motor.temperature_c = 45;
  motor.accel_mps2[0] = -12;
  motor.accel_mps2[2] = 9.5F;
  motor.flags = motor_health_t::FLAG_ANALOG_VALID;
  return motor;
}

motor_limits_t Limits() {
  motor_limits_t limits{};
  limits.power_upper_w[0] = 300;
  limits.power_upper_w[1] = 240;
  limits.power_lower_w[0] = 100;
  limits.overheat_c = 90;
  limits.shock_mps2 = 50;
  return limits;
}

TEST(TripMargins, AreWhatIsLeftUntilTheMotorTrips) {
  const auto margins = TripMargins(Motor(), Limits());
  const struct {
    const char* name;
    double measured, limit, margin;
  } kWanted[] = {{"power_upper_a", 250, 300, 50},  {"power_upper_b", 250, 240, -10},
                 {"power_lower_a", 250, 100, 150}, {"power_lower_b", 250, 0, NAN},
                 {"overheat", 45, 90, 45},         {"excessive_shock", 12, 50, 38}};
  ASSERT_EQ(margins.size(), std::size(kWanted));
  for (std::size_t i = 0; i < margins.size(); ++i) {
    EXPECT_EQ(margins.at(i).name, kWanted[i].name);
    EXPECT_EQ(margins.at(i).measured, kWanted[i].measured) << margins.at(i).name;
    EXPECT_EQ(margins.at(i).limit, kWanted[i].limit) << margins.at(i).name;
    if (std::isnan(kWanted[i].margin)) {
      EXPECT_TRUE(std::isnan(margins.at(i).margin)) << "a limit of 0 never trips";
    } else {
      EXPECT_EQ(margins.at(i).margin, kWanted[i].margin) << margins.at(i).name;
    }
  }
}

TEST(TripMargins, AreNotKnownWithoutALimitOrAReading) {
  motor_limits_t limits = Limits();
  limits.power_upper_w[0] = NAN;
  EXPECT_TRUE(std::isnan(TripMargins(Motor(), limits)[0].margin));
  motor_health_t motor = Motor();
  motor.accel_mps2[1] = NAN;
  EXPECT_TRUE(std::isnan(TripMargins(motor, limits)[5].measured)) << "the third axis may be the largest";
  EXPECT_EQ(TripMargins(motor, limits)[4].margin, 45);
  motor.flags = motor_health_t::FLAG_STATUS_VALID;
  for (const TripMargin& margin : TripMargins(motor, Limits())) {
    EXPECT_TRUE(std::isnan(margin.measured)) << margin.name;
    EXPECT_TRUE(std::isnan(margin.margin)) << margin.name;
  }
}

}  // namespace
}  // namespace axlecast
