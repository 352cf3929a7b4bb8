#include <gmock/gmock.h>
#include <vector>

#include "drivers/runtime/bus/transactor.h"
#include "tests/support/scripted_link.h"

namespace axlecast {
namespace {

using ::testing::ElementsAre;
using ::testing::IsEmpty;

constexpr MonoNs kStart = 1'000 * kSecond;

std::vector<std::uint8_t> Copy(Bytes bytes) { return {bytes.begin(), bytes.end()}; }

class LineMediumTest : public ::testing::Test {
 protected:
  LineMediumTest() {
    EXPECT_EQ(ErrorText(link_.Open()), "");
    link_.SetWriteTime(4 * kMicrosecond);
  }

  void Answer(std::vector<ScriptedLink::Burst> bursts) {
    link_.SetPeer([bursts](Bytes) { return bursts; });
  }

  FakeClock clock_{kStart};
  ScriptedLink link_{clock_};
  SerialTransactor medium_{link_, clock_, false, nullptr};
  const Exchange exchange_{.request = {0x1A}, .reply_length = &FixedLength<4>, .timeout = 100 * kMicrosecond};
};

TEST_F(LineMediumTest, ReplyInPiecesCarriesTheInstantsOfItsFirstAndLastRead) {
  Answer({{10 * kMicrosecond, {1, 2}}, {30 * kMicrosecond, {3, 4}}});
  ASSERT_EQ(medium_.FindStray(), nullptr);
  const Event* event = medium_.Run(exchange_);
  ASSERT_NE(event, nullptr);
  EXPECT_EQ(event->kind, Event::Kind::kReply);
  EXPECT_THAT(Copy(event->request), ElementsAre(0x1A));
  EXPECT_THAT(Copy(event->bytes), ElementsAre(1, 2, 3, 4));
  EXPECT_EQ(event->sent, (Interval{kStart, kStart + 4 * kMicrosecond}));
  EXPECT_EQ(event->received, (Interval{kStart + 14 * kMicrosecond, kStart + 34 * kMicrosecond}));
}

TEST_F(LineMediumTest, NotifiesBetweenTheRequestAndItsReply) {
  Answer({{10 * kMicrosecond, {1, 2, 3, 4}}});
  std::vector<MonoNs> notified;
  medium_.NotifyTransmitted([&] { notified.push_back(clock_.Now()); });
  const Event* event = medium_.Run(exchange_);
  EXPECT_EQ(event->kind, Event::Kind::kReply);
  EXPECT_THAT(notified, ElementsAre(event->sent.last));
  EXPECT_LT(event->sent.last, event->received.first);
}

TEST_F(LineMediumTest, NoReplyIsATimeoutCountedFromTheEndOfTheWrite) {
  const Event* event = medium_.Run(exchange_);
  EXPECT_EQ(event->kind, Event::Kind::kTimeout);
  EXPECT_THAT(event->bytes, IsEmpty());
  EXPECT_EQ(event->received.first, kStart + 104 * kMicrosecond);
  EXPECT_EQ(event->received.last, kStart + 104 * kMicrosecond);
}

TEST_F(LineMediumTest, AShortReplyIsATimeoutWithWhatCame) {
  Answer({{10 * kMicrosecond, {1, 2, 3}}});
  const Event* event = medium_.Run(exchange_);
  EXPECT_EQ(event->kind, Event::Kind::kTimeout);
  EXPECT_THAT(Copy(event->bytes), ElementsAre(1, 2, 3));
  EXPECT_EQ(clock_.Now(), kStart + 104 * kMicrosecond);
}

TEST_F(LineMediumTest, BytesBeyondTheReplyAreStrayAtTheNextTurn) {
  Answer({{10 * kMicrosecond, {1, 2, 3, 4, 5, 6}}});
  EXPECT_THAT(Copy(medium_.Run(exchange_)->bytes), ElementsAre(1, 2, 3, 4));
  const Event* stray = medium_.FindStray();
  ASSERT_NE(stray, nullptr);
  EXPECT_EQ(stray->kind, Event::Kind::kUnexpectedBytes);
  EXPECT_THAT(Copy(stray->bytes), ElementsAre(5, 6));
  EXPECT_EQ(medium_.FindStray(), nullptr);
}

TEST_F(LineMediumTest, ALateReplyIsStrayBeforeTheNextRequest) {
  Answer({{150 * kMicrosecond, {1, 2, 3, 4}}});
  EXPECT_EQ(medium_.Run(exchange_)->kind, Event::Kind::kTimeout);
  clock_.Advance(kMillisecond);
  const Event* stray = medium_.FindStray();
  ASSERT_NE(stray, nullptr);
  EXPECT_THAT(Copy(stray->bytes), ElementsAre(1, 2, 3, 4));
  EXPECT_EQ(stray->received.last, clock_.Now());
}

// One system call less for each reading in a slot: the wait for the slot watched the port.
TEST_F(LineMediumTest, AWaitThatEndedWithoutBytesIsTheLookForStrays) {
  EXPECT_EQ(medium_.Sleep(kStart + kMillisecond), nullptr);
  EXPECT_EQ(medium_.FindStray(), nullptr);
  EXPECT_EQ(link_.reads_now(), 0);
  EXPECT_EQ(medium_.FindStray(), nullptr);
  EXPECT_EQ(link_.reads_now(), 1) << "once";
}

TEST_F(LineMediumTest, AThreadThatWasInterruptedAfterItsWaitLooksAgain) {
  EXPECT_EQ(medium_.Sleep(kStart + kMillisecond), nullptr);
  link_.ArriveAt(clock_.Now() + 10 * kMicrosecond, {9});
  clock_.Advance(kMillisecond);
  const Event* stray = medium_.FindStray();
  ASSERT_NE(stray, nullptr);
  EXPECT_THAT(Copy(stray->bytes), ElementsAre(9));
}

// One character of 10 bits at 2.5 MBd takes 4 us, 3.88 us at least: request and reply 19.4 us.
TEST_F(LineMediumTest, AReplyThatTheWireCannotHaveCarriedIsStrayAndTheExchangeGoesOn) {
  SerialTransactor medium(link_, clock_, false, nullptr, {.baud = 2'500'000});
  Answer({{10 * kMicrosecond, {1, 2, 3, 4}}, {40 * kMicrosecond, {5, 6, 7, 8}}});
  const Event* event = medium.Run(exchange_);
  EXPECT_EQ(event->kind, Event::Kind::kReply);
  EXPECT_THAT(Copy(event->bytes), ElementsAre(5, 6, 7, 8));
  EXPECT_EQ(event->received, (Interval{kStart + 44 * kMicrosecond, kStart + 44 * kMicrosecond}));
  const Event* stray = medium.FindStray();
  ASSERT_NE(stray, nullptr);
  EXPECT_TRUE(stray->early);
  EXPECT_THAT(Copy(stray->bytes), ElementsAre(1, 2, 3, 4));
  EXPECT_EQ(medium.FindStray(), nullptr);
}

TEST_F(LineMediumTest, EveryReplyThatCameTooEarlyIsReported) {
  SerialTransactor medium(link_, clock_, false, nullptr, {.baud = 2'500'000});
  Answer({{8 * kMicrosecond, {1, 2, 3, 4}}, {12 * kMicrosecond, {5, 6, 7, 8}}, {40 * kMicrosecond, {9, 9, 9, 9}}});
  const Event* event = medium.Run(exchange_);
  EXPECT_THAT(Copy(event->bytes), ElementsAre(9, 9, 9, 9));
  const Event* stray = medium.FindStray();
  ASSERT_NE(stray, nullptr);
  EXPECT_TRUE(stray->early);
  EXPECT_THAT(Copy(stray->bytes), ElementsAre(1, 2, 3, 4, 5, 6, 7, 8));
  EXPECT_EQ(medium.FindStray(), nullptr);
}

TEST_F(LineMediumTest, AReplyWhoseFirstByteIsTooEarlyIsNoneEither) {
  SerialTransactor medium(link_, clock_, false, nullptr, {.baud = 2'500'000});
  Answer({{kMicrosecond, {1}}, {40 * kMicrosecond, {2, 3, 4}}});
  EXPECT_EQ(medium.Run(exchange_)->kind, Event::Kind::kTimeout);
}

TEST_F(LineMediumTest, ARateThatIsALittleFasterIsAllowedFor) {
  SerialTransactor medium(link_, clock_, false, nullptr, {.baud = 2'500'000});
  Answer({{15'500, {1, 2, 3, 4}}});
  EXPECT_EQ(medium.Run(exchange_)->kind, Event::Kind::kReply);
}

TEST_F(LineMediumTest, ASlowerRateTakesLonger) {
  SerialTransactor medium(link_, clock_, false, nullptr, {.baud = 2'500'000});
  ASSERT_EQ(medium.Run(SetBaudRate{1'250'000})->kind, Event::Kind::kBaudRateSet);
  Answer({{30 * kMicrosecond, {1, 2, 3, 4}}});
  EXPECT_EQ(medium.Run(exchange_)->kind, Event::Kind::kTimeout);
}

// Bytes before the reply came earlier: the reply's instant is that of its own first byte.
TEST_F(LineMediumTest, AReplyBehindStrayBytesIsAsOldAsItsOwnFirstByte) {
  Exchange exchange = exchange_;
  exchange.reply_length = [](Bytes so_far) { return so_far.size() < 2 ? std::size_t{0} : std::size_t{4}; };
  exchange.reply_begin = [](Bytes) { return std::size_t{2}; };
  Answer({{10 * kMicrosecond, {9, 9}}, {30 * kMicrosecond, {1}}, {50 * kMicrosecond, {2}}});
  const Event* event = medium_.Run(exchange);
  EXPECT_EQ(event->kind, Event::Kind::kReply);
  EXPECT_EQ(event->received, (Interval{kStart + 34 * kMicrosecond, kStart + 54 * kMicrosecond}));
}

TEST_F(LineMediumTest, ABabblingLineEndsAtTheBuffersEnd) {
  Answer({{0, std::vector<std::uint8_t>(1'000, 0x55)}});
  const Exchange never{.request = {0x1A}, .reply_length = [](Bytes) { return std::size_t{0}; }, .timeout = kSecond};
  const Event* event = medium_.Run(never);
  EXPECT_EQ(event->kind, Event::Kind::kTimeout);
  EXPECT_EQ(event->bytes.size(), kMaxFrame);
}

TEST_F(LineMediumTest, SilenceHoldsUntilNoByteHasComeForThatLong) {
  link_.ArriveAt(kStart + 50 * kMicrosecond, {7});
  const WaitForIdleLine silence{.quiet = 80 * kMicrosecond};
  const Event* event = medium_.Run(silence);
  EXPECT_EQ(event->kind, Event::Kind::kUnexpectedBytes);
  EXPECT_THAT(Copy(event->bytes), ElementsAre(7));
  event = medium_.Run(silence);
  EXPECT_EQ(event->kind, Event::Kind::kSilent);
  EXPECT_EQ(event->received, (Interval{kStart + 50 * kMicrosecond, kStart + 130 * kMicrosecond}));
}

TEST_F(LineMediumTest, ListensForWhatComesUnasked) {
  link_.ArriveAt(kStart + 10 * kMicrosecond, {1, 2});
  const Event* event = medium_.Run(Listen{kStart + kMillisecond}, kNever);
  ASSERT_NE(event, nullptr);
  EXPECT_EQ(event->kind, Event::Kind::kUnsolicited);
  EXPECT_THAT(Copy(event->bytes), ElementsAre(1, 2));
  EXPECT_EQ(event->received.first, kStart + 10 * kMicrosecond);
  event = medium_.Run(Listen{kStart + kMillisecond}, kNever);
  ASSERT_NE(event, nullptr);
  EXPECT_EQ(event->kind, Event::Kind::kSilent);
  EXPECT_EQ(clock_.Now(), kStart + kMillisecond);
}

TEST_F(LineMediumTest, ListeningIsInterruptedWithoutAnEvent) {
  link_.WakeAt(kStart + 10 * kMicrosecond);
  EXPECT_EQ(medium_.Run(Listen{kStart + kMillisecond}, kNever), nullptr);
  EXPECT_EQ(clock_.Now(), kStart + 10 * kMicrosecond);
  EXPECT_EQ(medium_.Run(Listen{kStart + kMillisecond}, kStart + 20 * kMicrosecond), nullptr);
  EXPECT_EQ(clock_.Now(), kStart + 20 * kMicrosecond);
}

TEST_F(LineMediumTest, WhatComesDuringSleepIsStray) {
  link_.ArriveAt(kStart + kMillisecond, {9});
  const Event* event = medium_.Sleep(kStart + kSecond);
  ASSERT_NE(event, nullptr);
  EXPECT_EQ(event->kind, Event::Kind::kUnexpectedBytes);
  EXPECT_EQ(medium_.Sleep(kStart + kSecond), nullptr);
  EXPECT_EQ(clock_.Now(), kStart + kSecond);
}

TEST_F(LineMediumTest, LossIsSeenInEveryStep) {
  link_.LoseAt(kStart + 20 * kMicrosecond);
  EXPECT_EQ(medium_.Run(exchange_)->kind, Event::Kind::kLinkDown);  // while it waits for the reply
  EXPECT_EQ(clock_.Now(), kStart + 20 * kMicrosecond);
  EXPECT_EQ(medium_.Run(exchange_)->kind, Event::Kind::kLinkDown);  // at the write
  EXPECT_EQ(medium_.FindStray()->kind, Event::Kind::kLinkDown);
  EXPECT_EQ(medium_.Run(WaitForIdleLine{1})->kind, Event::Kind::kLinkDown);
  EXPECT_EQ(medium_.Run(Listen{kNever}, kNever)->kind, Event::Kind::kLinkDown);
  EXPECT_EQ(medium_.Sleep(kNever)->kind, Event::Kind::kLinkDown);
}

class EchoLineMediumTest : public LineMediumTest {
 protected:
  SerialTransactor echoing_{link_, clock_, true, nullptr};
};

TEST_F(EchoLineMediumTest, TheRequestsOwnBytesAreNoReply) {
  Answer({{5 * kMicrosecond, {0x1A}}, {20 * kMicrosecond, {0x1A, 2, 3, 4}}});
  const Event* event = echoing_.Run(exchange_);
  EXPECT_EQ(event->kind, Event::Kind::kReply);
  EXPECT_THAT(Copy(event->bytes), ElementsAre(0x1A, 2, 3, 4));
  EXPECT_EQ(event->received.first, kStart + 24 * kMicrosecond);
}

TEST_F(EchoLineMediumTest, EchoAndReplyInOneRead) {
  Answer({{20 * kMicrosecond, {0x1A, 1, 2, 3, 4, 5}}});
  EXPECT_THAT(Copy(echoing_.Run(exchange_)->bytes), ElementsAre(1, 2, 3, 4));
  EXPECT_THAT(Copy(echoing_.FindStray()->bytes), ElementsAre(5));
}

TEST_F(EchoLineMediumTest, OnlyTheEchoIsATimeoutWithoutBytes) {
  Answer({{5 * kMicrosecond, {0x1A}}});
  const Event* event = echoing_.Run(exchange_);
  EXPECT_EQ(event->kind, Event::Kind::kTimeout);
  EXPECT_THAT(event->bytes, IsEmpty());
  EXPECT_EQ(event->received.first, kStart + 104 * kMicrosecond);
}

TEST_F(EchoLineMediumTest, ADamagedEchoIsNoReply) {
  Answer({{5 * kMicrosecond, {0x3A, 1, 2, 3, 4}}});
  const Event* event = echoing_.Run(exchange_);
  EXPECT_EQ(event->kind, Event::Kind::kTimeout);
  EXPECT_THAT(Copy(event->bytes), ElementsAre(0x3A, 1, 2, 3, 4));
}

using ::testing::ElementsAre;
using ::testing::IsEmpty;

// Lines beside the bus that note their pulses; a pulse takes as long as it was asked to.
class NotedLines final : public PulseLines {
 public:
  explicit NotedLines(FakeClock& clock) : clock_(clock) {}

  [[nodiscard]] Result<> Open() override { return {}; }
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
  LineStepsTest() { EXPECT_EQ(ErrorText(link_.Open()), ""); }

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
