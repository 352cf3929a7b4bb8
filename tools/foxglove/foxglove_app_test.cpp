#include "tools/foxglove/foxglove_app.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <axlecast/alarm_t.hpp>
#include <axlecast/position_t.hpp>
#include <memory>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <vector>

#include "core/messages/message.h"
#include "tests/support/fake_clock.h"
#include "tools/recorder/log_composer.h"

namespace axlecast {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::SizeIs;

const std::string kToken = "0123456789abcdef";

class FoxgloveAppTest : public ::testing::Test {
 protected:
  FoxgloveAppTest() {
    EXPECT_TRUE(definitions_.Add(SchemaText()));
    EXPECT_TRUE(definitions_.Finish().empty());
    Build({});
  }

  void Build(WebAccess::Rules rules) {
    access_ = std::make_unique<WebAccess>(rules, Secret(kToken));
    app_ = std::make_unique<FoxgloveApp>(FoxgloveParts{.clock = &clock_,
                                                       .access = access_.get(),
                                                       .definitions = &definitions_,
                                                       .name = "press3",
                                                       .session_id = "5",
                                                       .origins = {"https://viewer.example"},
                                                       .max_viewers = 2,
                                                       .tick = [] { return true; },
                                                       .problem = [this] { return problem_; }});
  }
  static WebRequest Upgrade() {
    return {.method = "GET", .path = "/", .host = "localhost:8765", .subprotocols = "x, foxglove.sdk.v1"};
  }
  // Returns the texts that wait for a viewer, and the number of its messages.
  [[nodiscard]] std::vector<nlohmann::json> Texts(WebConnection connection) {
    std::vector<nlohmann::json> texts;
    while (true) {
      const WebFrame frame = app_->NextFrame(connection);
      closed_ = frame.close;
      if (!frame.text) return texts;
      if (frame.binary) {
        ++messages_;
        continue;
      }
      texts.push_back(nlohmann::json::parse(*frame.text));
    }
  }
  void Position(const std::string& channel = "POSITION/axis1") {
    position_t message{};
    message.utime = 1'790'000'000'000'000;
    app_->OnMessage(channel, Encoded(message), 7);
  }

  FakeClock clock_;
  LcmDefinitions definitions_;
  std::string problem_;
  std::unique_ptr<WebAccess> access_;
  std::unique_ptr<FoxgloveApp> app_;
  int messages_ = 0;
  int closed_ = 0;
};

TEST_F(FoxgloveAppTest, AViewerLearnsTheChannelsAndReceivesWhatItSubscribesTo) {
  Position();
  app_->OnOpen(1);
  const auto first = Texts(1);
  ASSERT_THAT(first, SizeIs(2));
  EXPECT_EQ(first[0]["op"], "serverInfo");
  EXPECT_EQ(first[1]["channels"][0]["topic"], "/POSITION/axis1");
  app_->OnMessage("ALARM/axis1", Encoded(alarm_t{}), 7);
  const auto later = Texts(1);
  ASSERT_THAT(later, SizeIs(1));
  EXPECT_EQ(later[0]["channels"][0]["schemaName"], "axlecast/msg/Alarm");
  Position();
  static_cast<void>(Texts(1));
  EXPECT_EQ(messages_, 0);
  app_->OnFrame(1, R"({"op":"subscribe","subscriptions":[{"id":9,"channelId":1}]})");
  Position();
  const WebFrame frame = app_->NextFrame(1);
  ASSERT_TRUE(frame.text);
  EXPECT_TRUE(frame.binary);
  EXPECT_EQ(frame.text->substr(0, 13), FoxgloveMessageHead(9, 1'790'000'000'000'000'000U));
}

TEST_F(FoxgloveAppTest, AChannelWithAnotherTypeIsAnotherChannel) {
  Position("A");
  app_->OnOpen(1);
  app_->OnFrame(1, R"({"op":"subscribe","subscriptions":[{"id":9,"channelId":1}]})");
  static_cast<void>(Texts(1));
  app_->OnMessage("A", Encoded(alarm_t{}), 7);
  const auto texts = Texts(1);
  ASSERT_THAT(texts, SizeIs(2));
  EXPECT_EQ(texts[0], nlohmann::json::parse(R"({"op":"unadvertise","channelIds":[1]})"));
  EXPECT_EQ(texts[1]["channels"][0]["id"], 2);
  Position("A");
  static_cast<void>(Texts(1));
  EXPECT_EQ(messages_, 0);
}

TEST_F(FoxgloveAppTest, AnUnknownTypeIsReportedOnce) {
  const std::vector<std::uint8_t> message(20, 7);
  app_->OnOpen(1);
  static_cast<void>(Texts(1));
  for (int i = 0; i < 3; ++i) app_->OnMessage("X", message, 7);
  app_->OnMessage("Y", Bytes(message).first(5), 7);
  const auto texts = Texts(1);
  ASSERT_THAT(texts, SizeIs(1));
  EXPECT_THAT(texts[0]["message"], HasSubstr("'X' is not known: give its .lcm file with --types"));
  app_->OnOpen(2);
  EXPECT_EQ(Texts(2).back()["message"], texts[0]["message"]);
}

TEST_F(FoxgloveAppTest, NamesThatAnybodyInventsAreLimited) {
  app_->OnOpen(1);
  for (std::size_t i = 0; i <= FoxgloveFeed::kMaxChannels; ++i) Position("A" + std::to_string(i));
  EXPECT_THAT(Texts(1).back()["message"], HasSubstr("more than 4096 channels"));
}

TEST_F(FoxgloveAppTest, DamagedMessagesAreNotShown) {
  Position();
  app_->OnOpen(1);
  app_->OnFrame(1, R"({"op":"subscribe","subscriptions":[{"id":9,"channelId":1}]})");
  const std::vector<std::uint8_t> whole = Encoded(position_t{});
  app_->OnMessage("POSITION/axis1", Bytes(whole).first(whole.size() - 1), 7);
  static_cast<void>(Texts(1));
  EXPECT_EQ(messages_, 0);
}

TEST_F(FoxgloveAppTest, TooManyRequestsCloseTheConnection) {
  app_->OnOpen(1);
  for (int i = 0; i <= FoxgloveApp::kMaxRequests; ++i) app_->OnFrame(1, "{}");
  static_cast<void>(Texts(1));
  EXPECT_EQ(closed_, 1008);
}

TEST_F(FoxgloveAppTest, RequestsToChangeSomethingAreRefused) {
  app_->OnOpen(1);
  static_cast<void>(Texts(1));
  app_->OnFrame(1, R"({"op":"setParameters"})");
  app_->OnFrame(1, "{");
  const auto texts = Texts(1);
  ASSERT_THAT(texts, SizeIs(2));
  EXPECT_EQ(texts[0]["message"], "this server only shows messages: it does not support setParameters");
  EXPECT_EQ(texts[1]["level"], 2);
}

TEST_F(FoxgloveAppTest, WhoMayConnect) {
  EXPECT_EQ(app_->OnUpgrade(Upgrade()), 0);
  WebRequest request = Upgrade();
  request.subprotocols = "foxglove.websocket.v1";
  EXPECT_EQ(app_->OnUpgrade(request), 0);
  request.subprotocols = "";
  EXPECT_EQ(app_->OnUpgrade(request), 400);
  request = Upgrade();
  request.origin = "https://viewer.example";
  EXPECT_EQ(app_->OnUpgrade(request), 0);
  request.origin = "https://other.example";
  EXPECT_EQ(app_->OnUpgrade(request), 403);
  request = Upgrade();
  request.host = "other.example";
  EXPECT_EQ(app_->OnUpgrade(request), 403);
  request = Upgrade();
  request.path = "/ws";
  EXPECT_EQ(app_->OnUpgrade(request), 404);
  app_->OnOpen(1);
  app_->OnOpen(2);
  EXPECT_EQ(app_->OnUpgrade(Upgrade()), 503);
  app_->OnClose(1);
  EXPECT_EQ(app_->OnUpgrade(Upgrade()), 0);
}

TEST_F(FoxgloveAppTest, ATokenComesAsBearerOrInTheUrl) {
  Build({.tls = true, .token_required = true});
  WebRequest request = Upgrade();
  EXPECT_EQ(app_->OnUpgrade(request), 401);
  request.query = "a=b&token=" + kToken;
  EXPECT_EQ(app_->OnUpgrade(request), 0);
  request.query = "token=" + kToken + "0";
  EXPECT_EQ(app_->OnUpgrade(request), 401);
  request.authorization = "Bearer " + kToken;
  EXPECT_EQ(app_->OnUpgrade(request), 0);
}

TEST_F(FoxgloveAppTest, ABrowserLearnsWhatThisIs) {
  EXPECT_THAT(app_->OnRequest({.method = "GET", .path = "/", .host = "localhost:8765"}).body,
              HasSubstr("ws://localhost:8765"));
  EXPECT_EQ(app_->OnRequest({.method = "GET", .path = "/x", .host = "localhost"}).status, 404);
  EXPECT_EQ(app_->OnRequest({.method = "POST", .path = "/", .host = "localhost"}).status, 405);
  EXPECT_EQ(app_->OnRequest({.method = "GET", .path = "/", .host = "other.example"}).status, 421);
  problem_ = "the LCM port failed";
  EXPECT_EQ(app_->OnRequest({.method = "GET", .path = "/healthz", .host = "localhost"}).status, 503);
}

}  // namespace
}  // namespace axlecast
