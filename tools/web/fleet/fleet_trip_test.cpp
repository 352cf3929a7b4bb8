#include "tools/web/fleet/fleet_trip.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "core/messages/json/message_json.h"

namespace axlecast {
namespace {

using Json = nlohmann::ordered_json;

trip_log_t Trip() {
  trip_log_t trip{};
  trip.utime = 1'790'000'000'000'000;
  trip.device = "conveyor";
  trip.log_index = 1;
  trip.trip_count = 12;
  trip.factor_bits = 1;
  trip.not_after_utime = 1'789'999'999'000'000;
  trip.interval_us = 100'000;
  trip.valid_mask = 0x7F;
  trip.samples[2][19] = 401.5F;
  return trip;
}

TEST(TripOf, ReadsTheMessageThatTheDatabaseHas) {
  const auto trip = TripOf(ToJson(Trip()));
  ASSERT_TRUE(trip);
  EXPECT_EQ(trip->device, "conveyor");
  EXPECT_EQ(trip->trip_count, 12);
  EXPECT_EQ(trip->not_after_utime, 1'789'999'999'000'000);
  EXPECT_EQ(trip->valid_mask, 0x7F);
  EXPECT_EQ(trip->samples[2][19], 401.5F);
}

TEST(TripOf, RefusesWhatIsNoTrip) {
  const Json whole = ToJson(Trip());
  for (const char* key : {"device", "utime", "trip_count", "samples", "valid_mask", "interval_us"}) {
    Json json = whole;
    json.erase(key);
    EXPECT_FALSE(TripOf(json)) << key;
    json[key] = "nonsense";
    EXPECT_TRUE(!TripOf(json) || key == std::string("device")) << key;
  }
  Json json = whole;
  json["trip_count"] = std::int64_t{1} << 40;
  EXPECT_FALSE(TripOf(json));
  json = whole;
  json["samples"][3].push_back(1);
  EXPECT_FALSE(TripOf(json));
  json = whole;
  json["samples"][3][0] = "1";
  EXPECT_FALSE(TripOf(json));
  EXPECT_FALSE(TripOf(nullptr));
  EXPECT_FALSE(TripOf(Json::parse("[]")));
}

}  // namespace
}  // namespace axlecast
