#include <gmock/gmock.h>

#include <vector>

#include "drivers/runtime/bus/serial_transactor.h"
#include "tests/support/scripted_link.h"

namespace axlecast {
namespace {

using ::testing::ElementsAre;
using ::testing::IsEmpty;

constexpr MonoNs kStart = 1'000 * kSecond;

// Lines beside the bus that note their pulses; a pulse takes as long as it was asked to.
class NotedLines final : public PulseLines {
 public:
  explicit NotedLines(FakeClock& clock) : clock_(clock) {}

  [[nodiscard]] std::string Open() override { return ""; }
  void Close() override {}
  [[nodiscard]] bool Pulse(std::uint8_t line, MonoNs low) override {
    pulses.push_back(line);
    clock_.Advance(low);
    return works;
  }

  std::vector<int> pulses;
  bool works = true;

 private:
  FakeClock& clock_;
};

class LineStepsTest : public ::testing::Test {
 protected:
  LineStepsTest() { EXPECT_EQ(link_.Open(), ""); }

  FakeClock clock_{kStart};
  ScriptedLink link_{clock_};
  NotedLines lines_{clock_};
  SerialTransactor medium_{link_, clock_, false, &lines_};
};

TEST_F(LineStepsTest, APulseAsksForAReply) {
  link_.ArriveAt(kStart + 300 * kMicrosecond, {0xFF, 0x81, 1, 2, 3});
  const Event* event = medium_.Run(Exchange{.request = {},
                                            .reply_length = &FixedLength<5>,
                                            .timeout = kMillisecond,
                                            .pulse = Pulse{.line = 1, .low = 20 * kMicrosecond}});
  ASSERT_NE(event, nullptr);
  EXPECT_EQ(event->kind, Event::Kind::kReply);
  EXPECT_THAT(lines_.pulses, ElementsAre(1));
  EXPECT_THAT(link_.written(), IsEmpty());
  EXPECT_EQ(event->sent, (Interval{kStart, kStart + 20 * kMicrosecond}));
  EXPECT_EQ(event->received.first, kStart + 300 * kMicrosecond);
}

TEST_F(LineStepsTest, APulseAloneIsDoneWithinItsInterval) {
  const Event* event = medium_.Run(Pulse{.line = 0, .low = kMillisecond});
  EXPECT_EQ(event->kind, Event::Kind::kPulsed);
  EXPECT_EQ(event->sent, (Interval{kStart, kStart + kMillisecond}));
}

TEST_F(LineStepsTest, APulseThatCannotBeGivenIsALostLink) {
  lines_.works = false;
  EXPECT_EQ(medium_.Run(Pulse{})->kind, Event::Kind::kLinkDown);
  SerialTransactor without{link_, clock_, false, nullptr};
  EXPECT_EQ(without.Run(Pulse{})->kind, Event::Kind::kLinkDown);
}

TEST_F(LineStepsTest, GoesOnAtAnotherRate) {
  EXPECT_EQ(medium_.Run(SetBaudRate{.baud = 57'600})->kind, Event::Kind::kBaudRateSet);
  EXPECT_EQ(link_.baud(), 57'600);
  link_.RefuseBaud();
  EXPECT_EQ(medium_.Run(SetBaudRate{.baud = 12})->kind, Event::Kind::kLinkDown);
}

TEST_F(LineStepsTest, ARequestThatNobodyAnswersTakesItsTimeAndKeepsWhatCame) {
  link_.ArriveAt(kStart + kMillisecond, {9});
  const Event* event =
      medium_.Run(Exchange{.request = {0, 5}, .reply_length = nullptr, .timeout = 10 * kMillisecond});
  EXPECT_EQ(event->kind, Event::Kind::kTimeout);
  EXPECT_EQ(clock_.Now(), kStart + 10 * kMillisecond);
  EXPECT_THAT(std::vector<int>(event->bytes.begin(), event->bytes.end()), ElementsAre(9));
}

// A late reply comes as a stray, or in place of the reply to somebody else; and what came in its own place may have
// been late itself.
TEST_F(LineStepsTest, WhatMayBeTheLateReplyToASecretIsSecretToo) {
  const Exchange plain{.request = {2, 4}, .reply_length = &FixedLength<3>, .timeout = 10 * kMillisecond};
  Exchange secret{.request = {1, 3}, .reply_length = &FixedLength<3>, .timeout = 10 * kMillisecond};
  secret.secret = true;
  EXPECT_FALSE(medium_.Run(plain)->secret);
  for (const bool answered : {false, true}) {
    if (answered) link_.ArriveAt(clock_.Now() + kMillisecond, {1, 3, 9});
    EXPECT_TRUE(medium_.Run(secret)->secret);
    link_.ArriveAt(clock_.Now() + kMillisecond, {1, 3, 9});
    EXPECT_TRUE(medium_.Run(plain)->secret);
    link_.ArriveAt(clock_.Now() + kMillisecond, {2, 4});
    EXPECT_TRUE(medium_.Run(plain)->secret) << "a part of something";
    link_.ArriveAt(clock_.Now() + kMillisecond, {2, 4, 9, 1, 3});
    EXPECT_FALSE(medium_.Run(plain)->secret) << "its own reply";
    EXPECT_TRUE(medium_.FindStray()->secret) << "what came with it";
    link_.ArriveAt(clock_.Now(), {9});
    const Event* stray = medium_.FindStray();
    ASSERT_NE(stray, nullptr);
    EXPECT_TRUE(stray->secret);
    clock_.Advance(3 * kSecond);
    EXPECT_FALSE(medium_.Run(plain)->secret);
  }
}

}  // namespace
}  // namespace axlecast
