#include "tools/web/fleet_request.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace axlecast {
namespace {

using ::testing::HasSubstr;
using Kind = FleetRequest::Kind;

Result<FleetRequest> ParseQuestion(const std::string& text) {
  return ParseFleetRequest(nlohmann::ordered_json::parse(text));
}
std::string QuestionError(const std::string& text) { return ErrorText(ParseQuestion(text)); }

TEST(ParseFleetRequest, ReadsEveryQuestion) {
  EXPECT_EQ(ParseQuestion(R"({"type":"fleet_machines","id":7})").value(),
            (FleetRequest{.kind = Kind::kMachines, .id = 7}));
  EXPECT_EQ(ParseQuestion(R"({"type":"fleet_devices","id":0,"machine":"press3"})").value(),
            (FleetRequest{.kind = Kind::kDevices, .machine = "press3"}));
  for (const auto& [type, kind] : {std::pair{"fleet_alarms", Kind::kAlarms},
                                   {"fleet_commands", Kind::kCommands},
                                   {"fleet_trips", Kind::kTrips}}) {
    const auto request =
        ParseQuestion(R"({"id":1,"machine":"m","from_utime":5,"to_utime":6,"type":")" + std::string(type) + "\"}");
    ASSERT_TRUE(request) << type;
    EXPECT_EQ(*request, (FleetRequest{.kind = kind, .id = 1, .machine = "m", .from = 5, .to = 6}));
  }
  EXPECT_EQ(
      ParseQuestion(R"({"type":"fleet_curve","id":1,"machine":"m","device":"a","column":"power_w","from_utime":0,
                      "to_utime":4102444800000000})")
          .error()
          .text,
      "fleet_curve: more than 20 years");
  EXPECT_EQ(
      ParseQuestion(
          R"({"type":"fleet_curve","id":1,"machine":"m","device":"a","column":"turns","from_utime":1,"to_utime":2,
                      "later":{}})")
          .value(),
      (FleetRequest{
          .kind = Kind::kCurve, .id = 1, .machine = "m", .device = "a", .column = "turns", .from = 1, .to = 2}));
}

TEST(ParseFleetRequest, NamesWhatIsWrong) {
  EXPECT_THAT(QuestionError(R"({"type":"fleet_drop","id":1})"), HasSubstr("unknown question"));
  for (const char* id : {"", R"(,"id":-1)", R"(,"id":"1")", R"(,"id":1.5)", R"(,"id":9007199254740992)",
                         R"(,"id":18446744073709551615)", R"(,"id":null)"}) {
    EXPECT_THAT(QuestionError(R"({"type":"fleet_machines")" + std::string(id) + '}'), HasSubstr("id is not")) << id;
  }
  for (const std::string& machine :
       {std::string("7"), std::string("\"\""), '"' + std::string(129, 'm') + '"', std::string(R"("a\u0000b")")}) {
    EXPECT_THAT(QuestionError(R"({"type":"fleet_devices","id":1,"machine":)" + machine + '}'),
                HasSubstr("machine is not"))
        << machine;
  }
  const auto times = [](const std::string& from, const std::string& to) {
    return QuestionError(R"({"type":"fleet_alarms","id":1,"machine":"m","from_utime":)" + from + R"(,"to_utime":)" +
                         to + '}');
  };
  EXPECT_THAT(times("1", "1"), HasSubstr("not after"));
  EXPECT_THAT(times("-1", "1"), HasSubstr("not times"));
  EXPECT_THAT(times("1.0", "2"), HasSubstr("not times"));
  EXPECT_THAT(times("1", "4102444800000001"), HasSubstr("not times"));
  const std::string curve = R"({"type":"fleet_curve","id":1,"machine":"m","from_utime":1,"to_utime":2,)";
  EXPECT_THAT(QuestionError(curve + R"("column":"value"})"), HasSubstr("device is not"));
  for (const char* column : {"7", "\"\"", "\"value; DROP TABLE axlecast.log\"", "\"speed_rpm\""}) {
    EXPECT_THAT(QuestionError(curve + R"("device":"a","column":)" + column + '}'), HasSubstr("unknown column"))
        << column;
  }
}

TEST(FleetRequest, KnowsTypesAndColumns) {
  EXPECT_TRUE(IsFleetType("fleet_trips"));
  EXPECT_FALSE(IsFleetType("fleet_error"));
  EXPECT_FALSE(IsFleetType("subscribe"));
  EXPECT_EQ(FindCurveColumn("power_w")->unit, "W");
  EXPECT_FALSE(FindCurveColumn("value")->motor);
  EXPECT_EQ(FindCurveColumn("message"), nullptr);
}

}  // namespace
}  // namespace axlecast
