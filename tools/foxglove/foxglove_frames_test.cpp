#include "tools/foxglove/foxglove_frames.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <nlohmann/json.hpp>
#include <string>
#include <variant>

namespace axlecast {
namespace {

using ::testing::ElementsAre;

TEST(FoxgloveFrames, AreThoseOfTheProtocol) {
  EXPECT_EQ(
      nlohmann::json::parse(FoxgloveServerInfo("press3", "5")),
      nlohmann::json::parse(
          R"({"op":"serverInfo","name":"press3","capabilities":[],"supportedEncodings":[],"metadata":{},"sessionId":"5"})"));
  const FoxgloveChannel channel{.id = 3, .topic = "/A", .schema_name = "a/msg/B", .schema = "int8 x\n"};
  EXPECT_EQ(
      nlohmann::json::parse(FoxgloveAdvertise({&channel})),
      nlohmann::json::parse(
          R"({"op":"advertise","channels":[{"id":3,"topic":"/A","encoding":"cdr","schemaName":"a/msg/B","schemaEncoding":"ros2msg","schema":"int8 x\n"}]})"));
  EXPECT_EQ(FoxgloveUnadvertise({3, 4}), R"({"op":"unadvertise","channelIds":[3,4]})");
  EXPECT_EQ(FoxgloveStatus(FoxgloveLevel::kWarning, "slow", "x"),
            R"({"op":"status","level":1,"message":"slow","id":"x"})");
  EXPECT_EQ(FoxgloveMessageHead(0x01020304, 0x05060708090A0B0C),
            std::string("\x01\x04\x03\x02\x01\x0c\x0b\x0a\x09\x08\x07\x06\x05"));
}

TEST(FoxgloveFrames, TextThatIsNotUtf8IsConverted) {
  EXPECT_EQ(FoxgloveStatus(FoxgloveLevel::kInfo, "a\xff", ""),
            "{\"op\":\"status\",\"level\":0,\"message\":\"a\xef\xbf\xbd\",\"id\":\"\"}");
}

TEST(FoxgloveRequests, AreRead) {
  const auto subscribe = ParseFoxgloveRequest(
      R"({"op":"subscribe","subscriptions":[{"id":0,"channelId":3},{"id":4294967295,"channelId":4}]})");
  ASSERT_TRUE(subscribe);
  EXPECT_THAT(std::get<FoxgloveSubscribe>(*subscribe).subscriptions,
              ElementsAre(FoxgloveSubscribe::One{0, 3}, FoxgloveSubscribe::One{4'294'967'295U, 4}));
  const auto unsubscribe = ParseFoxgloveRequest(R"({"op":"unsubscribe","subscriptionIds":[0,7]})");
  ASSERT_TRUE(unsubscribe);
  EXPECT_THAT(std::get<FoxgloveUnsubscribe>(*unsubscribe).subscriptions, ElementsAre(0, 7));
  const auto other = ParseFoxgloveRequest(R"({"op":"getParameters","parameterNames":[]})");
  ASSERT_TRUE(other);
  EXPECT_EQ(std::get<FoxgloveUnsupported>(*other).operation, "getParameters");
}

TEST(FoxgloveRequests, AreRefusedIfTheyAreNotOfTheProtocol) {
  for (const char* text :
       {"", "x", "[]", "{}", R"({"op":1})", R"({"op":"subscribe"})", R"({"op":"subscribe","subscriptions":{}})",
        R"({"op":"subscribe","subscriptions":[1]})", R"({"op":"subscribe","subscriptions":[{"id":1}]})",
        R"({"op":"subscribe","subscriptions":[{"id":-1,"channelId":1}]})",
        R"({"op":"subscribe","subscriptions":[{"id":4294967296,"channelId":1}]})",
        R"({"op":"unsubscribe","subscriptionIds":["1"]})", R"({"op":"unsubscribe"})"}) {
    EXPECT_FALSE(ParseFoxgloveRequest(text)) << text;
  }
}

}  // namespace
}  // namespace axlecast
