#include "drivers/tformat/operations.h"

#include <axlecast/command_status_t.hpp>

#include "core/device/operation.h"
#include "drivers/tformat/device_test_support.h"

namespace axlecast::tformat {
namespace {

using Reason = command_status_t;

// 0.35 degrees of 2^17 counts (spec 9): 127.4 counts.
constexpr std::uint32_t kTolerance = 127;

TEST(ResetInterrupted, StopsBetweenAnyTwoRequestsWhenTheShaftBeginsToTurn) {
  for (int sent = 0; sent < 10; ++sent) {
    DeviceFixture bench;
    bench.GoOnline();
    bench.Begin("zero_single_turn");
    bench.Give(kId3, All(), false);
    bench.GiveResets(kId8, sent);
    bench.PassIdle();
    EXPECT_EQ(bench.Offered(), kId8);
    bench.output.motion = [](MonoNs) { return Motion{.known = true, .standstill = false, .speed_rpm = 3}; };
    bench.requests.clear();
    bench.Give(kId3, All());
    EXPECT_EQ(bench.Last().state, CommandState::kRejected);
    EXPECT_EQ(bench.Last().reason,
              sent == 0 ? Reason::REASON_NOT_STANDING_STILL + 0 : Reason::REASON_MOVED_DURING_SEQUENCE + 0);
    EXPECT_NE(bench.Last().text.find(Text("after %d of 10", sent)), std::string::npos) << bench.Last().text;
    EXPECT_EQ(bench.output.jumps, 0);
    EXPECT_EQ(bench.output.non_volatile_writes, 0);
    bench.Give(kId3, All());
    EXPECT_EQ(bench.output.datum_changing.size() % 2, 0u);
  }
}

TEST(ResetInterrupted, StopsWhenTheShaftHasCreptTooFar) {
  DeviceFixture bench;
  bench.GoOnline();
  bench.Begin("reset_turns_and_errors");
  bench.Give(kId3, All({.single_turn = 131'000}), false);
  bench.GiveResets(kIdC, 4, (131'000 + kTolerance) % 131'072);
  bench.PassIdle();
  bench.Give(kIdC, Short(kIdC, (131'000 + kTolerance + 1) % 131'072));
  EXPECT_EQ(bench.Last().state, CommandState::kRejected);
  EXPECT_EQ(bench.Last().reason, Reason::REASON_MOVED_DURING_SEQUENCE);
  EXPECT_NE(bench.Last().text.find("0.35"), std::string::npos);
  EXPECT_EQ(bench.Offered(false), kId3) << "nobody may complete this sequence";
}

TEST(ResetInterrupted, ALostReplyBeforeTheTenthEndsTheSequenceWithoutEffect) {
  const std::vector<std::pair<ByteList, std::int32_t>> replies = {
      {{}, Reason::REASON_NO_REPLY},
      {{0xC2, 0x00, 0x01}, Reason::REASON_NO_REPLY},
      {{0xC2, 0, 1, 2, 3, 0xFF}, Reason::REASON_NO_REPLY},
      {All(), Reason::REASON_DEVICE_REFUSED}};
  for (const auto& [reply, reason] : replies) {
    DeviceFixture bench;
    bench.GoOnline();
    bench.Begin("zero_single_turn");
    bench.Give(kId3, All(), false);
    bench.GiveResets(kId8, 8);
    bench.PassIdle();
    bench.Give(kId8, reply);
    EXPECT_EQ(bench.Last().state, CommandState::kFailed);
    EXPECT_EQ(bench.Last().reason, reason);
    EXPECT_NE(bench.Last().text.find("nothing was done, stopped after 9 of 10"), std::string::npos);
    if (bench.IsSilence()) bench.PassSilence();
    EXPECT_EQ(bench.Offered(false), kId3);
    bench.Give(kId3, All());
    EXPECT_EQ(bench.output.jumps, 0);
    EXPECT_EQ(bench.output.non_volatile_writes, 0);
  }
}

// Spec 6.3.2 (4): "the received data should be invalid without fail, and transmit the same Request signal again".
TEST(ResetInterrupted, ARequestAnsweredWithACommunicationAlarmIsSentAgain) {
  for (const std::uint8_t alarm : {std::uint8_t{0x40}, std::uint8_t{0x80}}) {
    for (int before = 0; before < 10; ++before) {
      DeviceFixture bench;
      bench.GoOnline();
      bench.Begin("zero_single_turn");
      bench.Give(kId3, All(), false);
      bench.requests.clear();
      bench.GiveResets(kId8, before);
      bench.PassIdle();
      bench.Give(kId8, All({.single_turn = 99, .status = alarm}));  // its data are invalid
      EXPECT_EQ(bench.FinalOutcomes(), 0);
      bench.GiveResets(kId8, 10 - before);
      bench.PassIdle();
      bench.Give(kId3, All({.single_turn = 0}));
      EXPECT_EQ(bench.Last().state, CommandState::kSucceeded) << before << ": " << bench.Last().text;
      ASSERT_EQ(bench.requests.size(), 12u);
      for (std::size_t i = 1; i <= 10; ++i) {
        EXPECT_EQ(bench.requests[i].second, kId8);
        EXPECT_GE(bench.requests[i].first - bench.requests[i - 1].first, 40 * kMillisecond) << "spec 9";
      }
      EXPECT_EQ(bench.output.non_volatile_writes, 1);
      EXPECT_EQ(bench.output.jumps, 1);
    }
  }
}

TEST(ResetInterrupted, TooManyCommunicationAlarmsEndTheSequence) {
  DeviceFixture bench;
  bench.GoOnline();
  bench.Begin("zero_single_turn");
  bench.Give(kId3, All(), false);
  bench.GiveResets(kId8, 2);
  for (int i = 0; i < 100 && bench.FinalOutcomes() == 0; ++i) {
    bench.PassIdle();
    bench.Give(kId8, All({.status = 0x40}));
  }
  EXPECT_EQ(bench.Last().state, CommandState::kFailed);
  EXPECT_EQ(bench.Last().reason, Reason::REASON_DEVICE_REFUSED);
  EXPECT_NE(bench.Last().text.find("nothing was done, stopped after 8 of 10"), std::string::npos)
      << bench.Last().text;
  EXPECT_EQ(bench.Offered(false), kId3);
}

TEST(ResetInterrupted, AfterACommunicationAlarmTheShaftMustStillRest) {
  DeviceFixture bench;
  bench.GoOnline();
  bench.Begin("zero_single_turn");
  bench.Give(kId3, All(), false);
  bench.GiveResets(kId8, 4);
  bench.PassIdle();
  bench.Give(kId8, All({.status = 0x40}));
  bench.PassIdle();
  bench.output.motion = [](MonoNs) { return Motion{.known = true, .standstill = false, .speed_rpm = 3}; };
  bench.Give(kId3, All());
  EXPECT_EQ(bench.Last().reason, Reason::REASON_MOVED_DURING_SEQUENCE);
}

// Whether the encoder counts an alarmed request is not documented: a jump after ten in all is no motion, but the effect.
TEST(ResetInterrupted, FromTenRequestsOnAReadingDecides) {
  DeviceFixture bench;
  bench.GoOnline();
  bench.Begin("zero_single_turn");
  bench.Give(kId3, All(), false);
  bench.GiveResets(kId8, 8);
  for (int alarm = 0; alarm < 2; ++alarm) {
    bench.PassIdle();
    bench.Give(kId8, All({.status = 0x40}));
  }
  bench.PassIdle();
  bench.Give(kId8, Short(kId8, 3));
  EXPECT_EQ(bench.FinalOutcomes(), 0) << bench.Last().text;
  bench.PassIdle();
  bench.Give(kId3, All({.single_turn = 3}));
  EXPECT_EQ(bench.Last().state, CommandState::kSucceeded) << bench.Last().text;
}

TEST(ResetInterrupted, ALostTenthReplyIsDecidedByReadingBack) {
  for (const bool effect : {true, false}) {
    DeviceFixture bench;
    bench.GoOnline();
    bench.Begin("zero_single_turn");
    bench.Give(kId3, All(), false);
    bench.GiveResets(kId8, 9);
    bench.PassIdle();
    bench.Give(kId8, {});
    EXPECT_EQ(bench.FinalOutcomes(), 0);
    bench.PassSilence();
    bench.PassIdle();
    bench.Give(kId3, All({.single_turn = effect ? 0U : 42405U}));
    EXPECT_EQ(bench.Last().state, effect ? CommandState::kSucceeded : CommandState::kFailed);
    EXPECT_NE(bench.Last().text.find("tenth reply was lost"), std::string::npos);
    EXPECT_EQ(bench.output.non_volatile_writes, 1) << "it may have been written";
  }
}

// The simulation of a whole machine found it: the power failed while the encoder stored the zero.
TEST(ResetInterrupted, AnEncoderThatWasSilentAfterTheTenthReplyMayHaveStoredNothing) {
  for (const bool silent : {false, true}) {
    DeviceFixture bench;
    bench.GoOnline({.single_turn = 0});
    bench.Begin("zero_single_turn");
    bench.Give(kId3, All({.single_turn = 0}), false);  // reads as zero before
    bench.GiveResets(kId8, 10, 0);
    bench.PassIdle();
    if (silent) {
      bench.Give(kId3, {});
      bench.PassSilence();
      bench.PassIdle();
    }
    bench.Give(kId3, All({.single_turn = 0}));
    ASSERT_EQ(bench.FinalOutcomes(), 1);
    EXPECT_EQ(bench.Last().state, silent ? CommandState::kIndeterminate : CommandState::kSucceeded);
    EXPECT_FALSE(bench.Last().verified);
  }
}

TEST(ResetInterrupted, IsIndeterminateWhenTheEffectCannotBeRead) {
  DeviceFixture bench;
  bench.GoOnline();
  bench.Begin("zero_single_turn");
  bench.Give(kId3, All(), false);
  bench.GiveResets(kId8, 10);
  bench.PassIdle();
  for (int i = 0; i < 100 && bench.FinalOutcomes() == 0; ++i) {
    bench.Give(kId3, {});
    bench.PassSilence();
  }
  EXPECT_EQ(bench.Last().state, CommandState::kIndeterminate);
  EXPECT_EQ(bench.Last().reason, Reason::REASON_NO_REPLY);
  EXPECT_EQ(bench.output.jumps, 0);
  bench.now += kSecond;
  bench.Give(kId3, All({.single_turn = 0}));
  EXPECT_EQ(bench.output.jumps, 1) << "the next reading may have jumped";
}

TEST(ResetInterrupted, OnALostLinkItDependsOnTheTenthRequest) {
  for (int sent = 0; sent <= 10; ++sent) {
    for (const bool in_flight : {false, true}) {
      if (in_flight && sent == 10) continue;
      DeviceFixture bench;
      bench.GoOnline();
      bench.Begin("reset_turns_and_errors");
      bench.Give(kId3, All(), false);
      bench.GiveResets(kIdC, sent);
      if (in_flight) {
        bench.PassIdle();
        bench.Start();
      }
      bench.LinkDown();
      const bool maybe = sent + (in_flight ? 1 : 0) >= 10;
      EXPECT_EQ(bench.Last().state, maybe ? CommandState::kIndeterminate : CommandState::kFailed);
      EXPECT_EQ(bench.Last().reason, Reason::REASON_NO_REPLY);
      bench.LinkUp();
      bench.PassSilence();
      bench.Give(kId3, All());
      // Nine that were answered and a link that broke: the tenth may have been on its way.
      EXPECT_EQ(bench.output.jumps, sent >= 9 ? 1 : 0);
      EXPECT_TRUE(bench.output.datum_changing.empty() || !bench.output.datum_changing.back());
    }
  }
}

TEST(ResetInterrupted, ATenthRequestThatALostLinkLeavesInDoubtCountsAsAWrite) {
  for (const int answered : {8, 9}) {
    for (const char* operation : {"zero_single_turn", "reset_turns_and_errors"}) {
      DeviceFixture bench;
      bench.GoOnline();
      bench.Begin(operation);
      bench.Give(kId3, All(), false);
      const bool zero = std::string(operation) == "zero_single_turn";
      bench.GiveResets(zero ? kId8 : kIdC, answered);
      bench.PassIdle();
      bench.Start();
      bench.LinkDown();
      EXPECT_EQ(bench.output.non_volatile_writes, zero && answered == 9 ? 1 : 0);
      bench.LinkUp();
      bench.LinkDown();
      EXPECT_EQ(bench.output.non_volatile_writes, zero && answered == 9 ? 1 : 0);
    }
  }
}

TEST(ResetInterrupted, IsRejectedWhenTheReadingBeforeFails) {
  DeviceFixture bench;
  bench.GoOnline();
  bench.Begin("zero_single_turn");
  for (int i = 0; i < 3; ++i) {
    bench.Give(kId3, {}, false);
    bench.PassSilence();
  }
  EXPECT_EQ(bench.Last().state, CommandState::kRejected);
  EXPECT_EQ(bench.Last().reason, Reason::REASON_NO_REPLY);
}

TEST(ResetInterrupted, CanBeCancelledUntilItsFirstRequest) {
  DeviceFixture bench;
  bench.GoOnline();
  bench.Begin("zero_single_turn");
  EXPECT_FALSE(bench.device->Cancel({9}, bench.now)) << "another order's id";
  bench.Give(kId3, All(), false);
  EXPECT_TRUE(bench.device->Cancel({1, 2, 3}, bench.now));
  EXPECT_TRUE(bench.output.outcomes.empty()) << "the caller reports it";
  bench.Begin("zero_single_turn");
  bench.Give(kId3, All(), false);
  bench.Start();
  EXPECT_FALSE(bench.device->Cancel({1, 2, 3}, bench.now));
}

TEST(ResetInterrupted, KeepsSilenceAfterStrayBytesBetweenTwoRequests) {
  DeviceFixture bench;
  bench.GoOnline();
  bench.Begin("zero_single_turn");
  bench.Give(kId3, All(), false);
  bench.GiveResets(kId8, 3);
  bench.Stray({0x55});
  bench.PassSilence();
  bench.GiveResets(kId8, 7);
  bench.PassIdle();
  bench.Give(kId3, All({.single_turn = 0}));
  EXPECT_EQ(bench.Last().state, CommandState::kSucceeded);
}

}  // namespace
}  // namespace axlecast::tformat
