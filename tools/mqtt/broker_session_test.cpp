#include "tools/mqtt/broker_session.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <utility>
#include <vector>

namespace axlecast {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;

// A broker in the test's hand.
class ScriptedLink final : public BrokerLink {
 public:
  void Connect(const BrokerMessage& message) override {
    ++connects;
    will = message;
    events.clear();
  }
  void Drop() override {
    ++drops;
    events.clear();
  }
  void Disconnect(bool /*publish_will*/) override { ++disconnects; }
  int Send(const BrokerMessage& message) override {
    sent.push_back(message.payload);
    return next_number++;
  }
  int Subscribe(const std::string& /*filter*/) override { return next_number++; }
  std::vector<BrokerEvent> Poll() override { return std::exchange(events, {}); }

  void Happens(BrokerEvent::Kind kind, int message = 0, std::string text = "") {
    events.push_back({kind, message, std::move(text), false});
  }

  int connects = 0;
  int drops = 0;
  int disconnects = 0;
  int next_number = 1;
  BrokerMessage will;
  std::vector<std::string> sent;
  std::vector<BrokerEvent> events;
};

class BrokerSessionTest : public ::testing::Test {
 protected:
  using Kind = BrokerEvent::Kind;

  void Put(const std::string& payload) { outbox_.Put({"t", payload, false}, RetentionClass::kSamples); }
  void Step(MonoNs by = 0) {
    now_ += by;
    next_ = session_.Step(now_);
  }
  // From the first step on.
  void Connected() {
    Step();
    link_.Happens(Kind::kConnected);
    Step();
    link_.sent.clear();
    link_.Happens(Kind::kTaken, link_.next_number - 1);
    Step();
  }
  void ConnectionEnds(const std::string& why = "lost") {
    link_.Happens(Kind::kDown, 0, why);
    Step();
  }

  Outbox outbox_{{1'000, 1 << 20}};
  ScriptedLink link_;
  BrokerSession session_{
      link_, outbox_, {"axlecast/m/status", "offline", [] { return "online"; }, [] { return "ended"; }}};
  MonoNs now_ = 1'000 * kSecond;
  MonoNs next_ = 0;
};

TEST_F(BrokerSessionTest, ConnectsWithAWillAndSaysFirstThatItIsThere) {
  Put("p1");
  Step();
  EXPECT_EQ(link_.connects, 1);
  EXPECT_EQ(link_.will.payload, "offline");
  EXPECT_TRUE(link_.will.retain);
  EXPECT_THAT(link_.sent, IsEmpty()) << "not before the broker has answered";
  EXPECT_FALSE(session_.status().connected);
  link_.Happens(Kind::kConnected);
  Step();
  EXPECT_THAT(link_.sent, ElementsAre("online", "p1"));
  EXPECT_TRUE(session_.status().connected);
}

TEST_F(BrokerSessionTest, WhatIsConfirmedIsGone) {
  Connected();
  Put("p1");
  Step();
  EXPECT_THAT(link_.sent, ElementsAre("p1"));
  EXPECT_EQ(outbox_.counts().messages, 1);
  link_.Happens(Kind::kTaken, link_.next_number - 1);
  Step();
  EXPECT_EQ(outbox_.counts().messages, 0);
  EXPECT_EQ(outbox_.counts().taken, 1);
}

TEST_F(BrokerSessionTest, KeepsAWindowOnItsWay) {
  Connected();
  for (int i = 0; i < 50; ++i) Put(std::to_string(i));
  Step();
  EXPECT_EQ(link_.sent.size(), BrokerSession::kWindow);
  EXPECT_FALSE(session_.WantsMore());
  link_.Happens(Kind::kTaken, link_.next_number - 1);
  Step();
  EXPECT_EQ(link_.sent.size(), BrokerSession::kWindow + 1);
}

TEST_F(BrokerSessionTest, SendsAgainInOrderWhatALostConnectionMayHaveSwallowed) {
  Connected();
  for (const char* payload : {"1", "2", "3"}) Put(payload);
  Step();
  link_.Happens(Kind::kTaken, link_.next_number - 3);
  Step();
  ConnectionEnds("Connection reset by peer");
  EXPECT_FALSE(session_.status().connected);
  EXPECT_EQ(session_.status().problem, "Connection reset by peer");
  Put("4");
  link_.sent.clear();
  Step(BrokerSession::kFirstPause);
  link_.Happens(Kind::kConnected);
  Step();
  EXPECT_THAT(link_.sent, ElementsAre("online", "2"));
  link_.Happens(Kind::kTaken, link_.next_number - 1);
  Step();
  EXPECT_THAT(link_.sent, ElementsAre("online", "2", "3", "4"));
  EXPECT_EQ(session_.status().connections, 2);
}

TEST_F(BrokerSessionTest, PausesLongerAndLongerBetweenAttempts) {
  Step();
  MonoNs pause = BrokerSession::kFirstPause;
  for (int attempt = 1; attempt < 8; ++attempt) {
    EXPECT_EQ(link_.connects, attempt);
    ConnectionEnds("Connection refused");
    EXPECT_EQ(next_, now_ + pause);
    Step(pause - 1);
    EXPECT_EQ(link_.connects, attempt);
    Step(1);
    pause = std::min(2 * pause, BrokerSession::kLongestPause);
  }
  link_.Happens(Kind::kConnected);
  Step();
  ConnectionEnds();
  EXPECT_EQ(next_, now_ + BrokerSession::kLongestPause) << "a connection that ends at once does not count";
  Step(BrokerSession::kLongestPause);
  link_.Happens(Kind::kConnected);
  Step();
  Step(BrokerSession::kStable);
  ConnectionEnds();
  EXPECT_EQ(next_, now_ + BrokerSession::kFirstPause) << "a stable connection resets the pause";
}

TEST_F(BrokerSessionTest, GivesUpOnABrokerThatDoesNotAnswer) {
  Step();
  Step(BrokerSession::kAnswer - 1);
  EXPECT_EQ(link_.drops, 0);
  Step(1);
  EXPECT_EQ(link_.drops, 1);
  EXPECT_THAT(session_.status().problem, HasSubstr("does not answer"));
  Step(BrokerSession::kFirstPause);
  EXPECT_EQ(link_.connects, 2);
}

TEST_F(BrokerSessionTest, GivesUpOnABrokerThatConfirmsNothing) {
  Connected();
  Put("p1");
  Step();
  EXPECT_LE(next_, now_ + BrokerSession::kConfirmation);
  Step(BrokerSession::kConfirmation);
  EXPECT_FALSE(session_.status().connected);
  EXPECT_EQ(outbox_.counts().messages, 1);
}

TEST_F(BrokerSessionTest, AMessageOverWhichEachConnectionEndsIsGivenUp) {
  Connected();
  Put("poison");
  Put("good");
  for (int i = 0; i < BrokerSession::kMaxTries; ++i) {
    EXPECT_EQ(outbox_.counts().refused, 0) << i;
    Step();
    ConnectionEnds();
    Step(BrokerSession::kLongestPause);
    link_.Happens(Kind::kConnected);
    Step();
  }
  EXPECT_EQ(outbox_.counts().refused, 1);
  EXPECT_EQ(link_.sent.back(), "good");
}

// A broker that breaks the protocol, or with it the process of the connection, does so whatever it is sent.
TEST_F(BrokerSessionTest, NoMessageIsGivenUpForABrokerThatBreaksTheProtocol) {
  Connected();
  Put("good");
  for (int i = 0; i < 3 * BrokerSession::kMaxTries; ++i) {
    Step();
    link_.events.push_back({Kind::kDown, 0, "killed by signal 6", true});
    Step();
    Step(BrokerSession::kLongestPause);
    link_.Happens(Kind::kConnected);
    Step();
  }
  EXPECT_EQ(outbox_.counts().refused, 0);
  EXPECT_EQ(outbox_.counts().messages, 1);
}

TEST_F(BrokerSessionTest, ASecondAnswerToTheConnectionTellsNothing) {
  Connected();
  const std::size_t before = link_.sent.size();
  for (int i = 0; i < 100; ++i) link_.Happens(Kind::kConnected);
  Step();
  EXPECT_EQ(session_.status().connections, 1);
  EXPECT_EQ(link_.sent.size(), before);
}

// mosquitto 2.0.11 closes the connection after it has refused a message; what it has not read by then takes its answer along.
TEST_F(BrokerSessionTest, SendsTheSuspectAloneSoThatItsRefusalArrives) {
  Connected();
  Put("forbidden");
  Put("good");
  Step();
  ConnectionEnds();
  Step(BrokerSession::kLongestPause);
  link_.Happens(Kind::kConnected);
  Step();
  EXPECT_EQ(link_.sent.back(), "forbidden");
  link_.Happens(Kind::kRefused, link_.next_number - 1, "Not authorized");
  Step();
  EXPECT_EQ(outbox_.counts().refused, 1);
  EXPECT_EQ(link_.sent.back(), "good");
  ConnectionEnds("Connection reset by peer");
  EXPECT_EQ(session_.status().problem,
            "Connection reset by peer; before, the broker refuses messages: Not authorized");
}

TEST_F(BrokerSessionTest, TellsWhatTheBrokerRefuses) {
  Connected();
  Put("p1");
  Step();
  link_.Happens(Kind::kRefused, link_.next_number - 1, "Not authorized");
  Step();
  EXPECT_EQ(outbox_.counts().refused, 1);
  EXPECT_EQ(outbox_.counts().messages, 0);
  EXPECT_THAT(session_.status().problem, HasSubstr("Not authorized"));
  EXPECT_TRUE(session_.status().connected);
}

TEST_F(BrokerSessionTest, SaysNowAndThenHowItIs) {
  Connected();
  Step(BrokerSession::kStatusEvery);
  EXPECT_THAT(link_.sent, ElementsAre("online"));
}

TEST_F(BrokerSessionTest, EndsWhenTheBrokerHasEverything) {
  Connected();
  Put("p1");
  Step();
  session_.End(now_ + 5 * kSecond);
  Step();
  EXPECT_THAT(link_.sent, ElementsAre("p1"));
  link_.Happens(Kind::kTaken, link_.next_number - 1);
  Step();
  EXPECT_THAT(link_.sent, ElementsAre("p1", "ended"));
  EXPECT_FALSE(session_.ended());
  link_.Happens(Kind::kTaken, link_.next_number - 1);
  Step();
  EXPECT_TRUE(session_.ended());
  EXPECT_EQ(link_.disconnects, 1);
}

TEST_F(BrokerSessionTest, EndsWithABrokerThatTakesNothing) {
  Connected();
  Put("p1");
  Step();
  session_.End(now_ + 5 * kSecond);
  Step(5 * kSecond);
  EXPECT_EQ(link_.sent.back(), "ended");
  Step(kSecond);
  EXPECT_TRUE(session_.ended());
  EXPECT_EQ(outbox_.counts().messages, 1);
}

TEST_F(BrokerSessionTest, EndsAtOnceWithoutAConnection) {
  Step();
  session_.End(now_ + 5 * kSecond);
  EXPECT_TRUE(session_.ended());
}

}  // namespace
}  // namespace axlecast
