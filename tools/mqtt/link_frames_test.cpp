#include "tools/mqtt/link_frames.h"

#include <gtest/gtest.h>

namespace axlecast {
namespace {

constexpr std::size_t kLongest = 1000;

// The one body that a stream of frames holds.
std::string BodyOf(const std::string& stream) {
  FrameBuffer buffer(kLongest);
  buffer.Add(stream);
  return buffer.Next().value_or("");
}

LinkCommand Connect() {
  LinkCommand command{.kind = LinkCommand::Kind::kConnect, .message = {"a/status", "gone", true}};
  command.settings = {.host = "broker.example",
                      .port = 8883,
                      .version_5 = false,
                      .client_id = "id",
                      .user = "press3",
                      .password = {.file = "/p", .credential = "c", .group_may_read = true},
                      .tls = true,
                      .ca = "/ca",
                      .certificate = "/cert",
                      .key = "/key",
                      .keep_alive_s = 7,
                      .attempts = 3};
  return command;
}

TEST(LinkFramesTest, AnOrderToConnectCarriesEverySetting) {
  const auto command = DecodeCommand(BodyOf(EncodeCommand(Connect())));
  ASSERT_TRUE(command);
  EXPECT_EQ(command->kind, LinkCommand::Kind::kConnect);
  EXPECT_EQ(command->message.topic, "a/status");
  EXPECT_TRUE(command->message.retain);
  const MqttLinkSettings& settings = command->settings;
  EXPECT_EQ(settings.host, "broker.example");
  EXPECT_EQ(settings.port, 8883);
  EXPECT_FALSE(settings.version_5);
  EXPECT_EQ(settings.client_id, "id");
  EXPECT_EQ(settings.user, "press3");
  EXPECT_EQ(settings.password.file, "/p");
  EXPECT_EQ(settings.password.credential, "c");
  EXPECT_TRUE(settings.password.group_may_read);
  EXPECT_TRUE(settings.tls);
  EXPECT_EQ(settings.ca + settings.certificate + settings.key, "/ca/cert/key");
  EXPECT_EQ(settings.keep_alive_s, 7);
  EXPECT_EQ(settings.attempts, 3U);
}

TEST(LinkFramesTest, MessagesAndEventsComeThroughWhateverBytesTheyHold) {
  const std::string bytes("a\0\xff\n", 4);
  const auto command = DecodeCommand(
      BodyOf(EncodeCommand({.kind = LinkCommand::Kind::kSend, .message = {"t", bytes, false}, .id = 41})));
  ASSERT_TRUE(command);
  EXPECT_EQ(command->id, 41);
  EXPECT_EQ(command->message.payload, bytes);
  for (const auto kind : {BrokerEvent::Kind::kConnected, BrokerEvent::Kind::kTaken, BrokerEvent::Kind::kRefused,
                          BrokerEvent::Kind::kReceived, BrokerEvent::Kind::kDown}) {
    const auto event = DecodeEvent(BodyOf(EncodeEvent({kind, -3, bytes, true, "topic", true, true})));
    ASSERT_TRUE(event);
    EXPECT_EQ(event->kind, kind);
    EXPECT_EQ(event->message, -3);
    EXPECT_EQ(event->text, bytes);
    EXPECT_TRUE(event->fault);
    EXPECT_EQ(event->topic, "topic");
    EXPECT_TRUE(event->retained);
    EXPECT_TRUE(event->taken_over);
  }
}

TEST(LinkFramesTest, QosSubscriptionsAndTheEndWithTheWillComeThrough) {
  const auto sent = DecodeCommand(
      BodyOf(EncodeCommand({.kind = LinkCommand::Kind::kSend, .message = {.topic = "t", .qos = 0}, .id = 1})));
  ASSERT_TRUE(sent);
  EXPECT_EQ(sent->message.qos, 0);
  const auto subscribed = DecodeCommand(
      BodyOf(EncodeCommand({.kind = LinkCommand::Kind::kSubscribe, .message = {.topic = "a/+"}, .id = 2})));
  ASSERT_TRUE(subscribed);
  EXPECT_EQ(subscribed->kind, LinkCommand::Kind::kSubscribe);
  EXPECT_EQ(subscribed->message.topic, "a/+");
  EXPECT_EQ(subscribed->id, 2);
  for (const bool publish_will : {false, true}) {
    const auto ended = DecodeCommand(
        BodyOf(EncodeCommand({.kind = LinkCommand::Kind::kDisconnect, .publish_will = publish_will})));
    ASSERT_TRUE(ended);
    EXPECT_EQ(ended->publish_will, publish_will);
  }
}

TEST(LinkFramesTest, FramesComeInPiecesAndSeveralAtOnce) {
  const std::string stream =
      EncodeEvent({BrokerEvent::Kind::kTaken, 1, ""}) + EncodeEvent({BrokerEvent::Kind::kTaken, 2, "two"});
  FrameBuffer buffer(kLongest);
  std::vector<int> numbers;
  for (const char byte : stream) {
    buffer.Add({&byte, 1});
    while (const auto body = buffer.Next()) numbers.push_back(DecodeEvent(*body).value().message);
  }
  EXPECT_EQ(numbers, (std::vector{1, 2}));
}

TEST(LinkFramesTest, WhatIsCutOrTooLongOrOfNoKindIsRefused) {
  const std::string body = BodyOf(EncodeCommand(Connect()));
  for (std::size_t size = 0; size < body.size(); ++size) EXPECT_FALSE(DecodeCommand(body.substr(0, size))) << size;
  EXPECT_FALSE(DecodeCommand(body + "x"));
  EXPECT_FALSE(DecodeCommand(std::string(4, '\x7f')));
  const std::string event = BodyOf(EncodeEvent({BrokerEvent::Kind::kDown, 0, "why"}));
  for (std::size_t size = 0; size < event.size(); ++size) EXPECT_FALSE(DecodeEvent(event.substr(0, size))) << size;
  FrameBuffer buffer(kLongest);
  buffer.Add(std::string("\xff\xff\xff\x7f", 4));
  EXPECT_FALSE(buffer.Next());
  EXPECT_TRUE(buffer.bad());
}

}  // namespace
}  // namespace axlecast
