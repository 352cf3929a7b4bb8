#include "tools/convert/conversion.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <vector>

#include "core/messages/json/message_json.h"
#include "tools/convert/test_events.h"

namespace axlecast {
namespace {

const nlohmann::ordered_json kMessage =
    nlohmann::ordered_json::parse(R"({"a": 1, "list": [[2, 3], []], "in": {"b": "x"}})");

TEST(FlatFields, NamesEveryPlainValueInOrder) {
  std::vector<std::string> names;
  VisitFields(kMessage,
              [&](const std::string& name, const auto& value) { names.push_back(name + '=' + value.dump()); });
  EXPECT_THAT(names, testing::ElementsAre("a=1", "list[0][0]=2", "list[0][1]=3", "in.b=\"x\""));
}

TEST(FlatFields, TheNamesOfOneNumbersFlagsAreOneValue) {
  const auto message = nlohmann::ordered_json::parse(
      R"({"flags": 3, "flag_names": ["valid", "simulated"], "trip_factor_names": [["overheat"], []]})");
  std::vector<std::string> names;
  VisitFields(message,
              [&](const std::string& name, const auto& value) { names.push_back(name + '=' + value.dump()); });
  EXPECT_THAT(names, testing::ElementsAre("flags=3", "flag_names=\"valid simulated\"",
                                          "trip_factor_names[0]=\"overheat\"", "trip_factor_names[1]=\"\""));
}

TEST(FlatFields, FindsWhatItNames) {
  VisitFields(kMessage, [&](const std::string& name, const auto& value) {
    ASSERT_NE(FindField(kMessage, name), nullptr) << name;
    EXPECT_EQ(*FindField(kMessage, name), value);
  });
  for (const char* name : {"b", "list[2]", "list[0][2]", "list[", "list[0", "list[]", "list[-1]", "a[0]", "a.b",
                           "in.c", "list[99999999999999999999999]", "[0]"}) {
    EXPECT_EQ(FindField(kMessage, name), nullptr) << name;
  }
}

TEST(FlatFields, TellsTypesWhoseMessagesDiffer) {
  TestEvents events;
  events.Add(0, "POSITION/a", position_t{});
  events.range()([](const LogEvent& event) {
    EXPECT_TRUE(AlwaysSameFields(FindMessageType(event.data)->schema));
    return true;
  });
  EXPECT_FALSE(AlwaysSameFields(
      R"({"type": "object", "properties": {"n": {"type": "array", "items": {"type": "integer"}}}})"));
  EXPECT_FALSE(AlwaysSameFields(R"({"type": "object", "properties": {"n": {"anyOf": [{"type": "null"}]}}})"));
}

}  // namespace
}  // namespace axlecast
