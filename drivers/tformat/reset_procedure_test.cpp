#include "drivers/tformat/operations.h"

#include <axlecast/command_status_t.hpp>

#include "drivers/tformat/device_test_support.h"

namespace axlecast::tformat {
namespace {

using Reason = command_status_t;

// 0.35 degrees of 2^17 counts (spec 9): 127.4 counts.
constexpr std::uint32_t kTolerance = 127;

TEST(ResetProcedure, ZeroesAndVerifies) {
  DeviceFixture bench;
  bench.GoOnline();
  bench.requests.clear();
  bench.Begin("zero_single_turn");
  bench.Give(kId3, All(), false);
  bench.GiveResets(kId8, 10);
  const MonoNs tenth = bench.now;
  EXPECT_EQ(bench.output.jumps, 0);
  bench.PassIdle();
  EXPECT_GE(bench.now - tenth, 18 * kMillisecond) << "spec 9: it takes maximum 18 ms";
  EXPECT_EQ(bench.FinalOutcomes(), 0);
  const std::size_t samples = bench.output.samples.size();
  bench.Give(kId3, All({.single_turn = 131'060}));
  EXPECT_EQ(bench.Last().state, CommandState::kSucceeded);
  EXPECT_TRUE(bench.Last().verified);
  EXPECT_EQ(bench.FinalOutcomes(), 1);
  ASSERT_EQ(bench.Last().changes.size(), 1u);
  EXPECT_EQ(bench.Last().changes[0].before, "42405");
  EXPECT_EQ(bench.Last().changes[0].after, "131060");
  EXPECT_EQ(bench.output.jumps, 1);
  EXPECT_EQ(bench.output.non_volatile_writes, 1) << "ID 8 writes the encoder's EEPROM";
  EXPECT_EQ(bench.output.datum_changing, (std::vector<bool>{true, false}));
  EXPECT_EQ(bench.output.samples.size(), samples + 1);
}

TEST(ResetProcedure, SendsTenRequestsAtLeast40MsApartAndNothingInBetween) {
  for (const auto& [operation, request] :
       {std::pair{"zero_single_turn", kId8}, {"reset_turns_and_errors", kIdC}, {"clear_errors", kId7}}) {
    DeviceFixture bench;
    bench.GoOnline();
    bench.requests.clear();
    bench.Begin(operation);
    bench.Give(kId3, All(), false);
    for (int i = 0; i < 10; ++i) {
      // A bus that offers every millisecond a slot for a live reading.
      while (bench.IsIdle(true)) bench.now += 1 * kMillisecond;
      bench.Give(request, Short(request));
    }
    while (bench.IsIdle(true)) bench.now += 1 * kMillisecond;
    bench.Give(kId3, All({.single_turn = 0, .turns = 0}));
    ASSERT_EQ(bench.requests.size(), 12u);
    EXPECT_EQ(bench.requests[0].second, kId3);
    for (std::size_t i = 1; i <= 10; ++i) EXPECT_EQ(bench.requests[i].second, request);
    for (std::size_t i = 2; i <= 10; ++i) {
      EXPECT_GE(bench.requests[i].first - bench.requests[i - 1].first, 40 * kMillisecond);
      EXPECT_LT(bench.requests[i].first - bench.requests[i - 1].first, 45 * kMillisecond);
    }
    EXPECT_EQ(bench.requests[11].second, kId3);
    EXPECT_EQ(bench.Last().state, CommandState::kSucceeded) << operation << ": " << bench.Last().text;
  }
}

TEST(ResetProcedure, ReadingsGoOnDuringTheSequence) {
  DeviceFixture bench;
  bench.GoOnline();
  bench.Begin("zero_single_turn");
  bench.Give(kId3, All(), false);
  const std::size_t samples = bench.output.samples.size();
  bench.GiveResets(kId8, 10);
  EXPECT_EQ(bench.output.samples.size(), samples + 10);
  EXPECT_EQ(bench.output.samples.back().counts, 42405);
}

TEST(ResetProcedure, FailsWhenTheReadBackIsNotZero) {
  for (const std::uint32_t reads : {kTolerance + 1, 131'072 - kTolerance - 1, 42405U}) {
    DeviceFixture bench;
    bench.GoOnline();
    bench.Begin("zero_single_turn");
    bench.Give(kId3, All(), false);
    bench.GiveResets(kId8, 10);
    bench.PassIdle();
    bench.Give(kId3, All({.single_turn = reads}));
    EXPECT_EQ(bench.Last().state, CommandState::kFailed);
    EXPECT_EQ(bench.Last().reason, Reason::REASON_READ_BACK_DIFFERS);
    EXPECT_FALSE(bench.Last().verified);
    EXPECT_EQ(bench.Last().changes.at(0).after, std::to_string(reads));
  }
}

TEST(ResetProcedure, IsRejectedWhileTheShaftTurns) {
  for (const char* operation : {"zero_single_turn", "reset_turns_and_errors"}) {
    DeviceFixture bench;
    bench.GoOnline();
    bench.output.motion = [](MonoNs) { return Motion{.known = true, .standstill = false, .speed_rpm = 12.5}; };
    bench.Begin(operation);
    EXPECT_EQ(bench.Last().state, CommandState::kRejected);
    EXPECT_EQ(bench.Last().reason, Reason::REASON_NOT_STANDING_STILL);
    EXPECT_NE(bench.Last().text.find("12.5 rpm"), std::string::npos);
    bench.output.motion = [](MonoNs) { return Motion{}; };
    bench.Begin(operation);
    EXPECT_EQ(bench.Last().reason, Reason::REASON_NOT_STANDING_STILL) << "unknown is not at rest";
  }
}

TEST(ResetProcedure, ClearsErrorsAlsoWhileTheShaftTurns) {
  DeviceFixture bench;
  bench.GoOnline();
  bench.output.motion = [](MonoNs) { return Motion{}; };
  bench.Begin("clear_errors");
  bench.Give(kId3, All({.alarms = 0x08}), false);
  for (std::uint32_t i = 0; i < 10; ++i) {
    bench.PassIdle();
    bench.Give(kId7, Short(kId7, i * 1000));
  }
  bench.PassIdle();
  bench.Give(kId3, All());
  EXPECT_EQ(bench.Last().state, CommandState::kSucceeded);
  EXPECT_EQ(bench.output.jumps, 0);
  EXPECT_TRUE(bench.output.datum_changing.empty());
}

// A creep below every speed limit still must not exceed 0.35 degrees in all.
TEST(ResetProcedure, ResetsTurnsReportsAlmcBeforeAndRestoresTheReference) {
  DeviceFixture bench;
  bench.GoOnline({.turns = 4660, .alarms = 0x48, .status = 0x20});
  EXPECT_EQ(bench.output.references_lost, 1);
  bench.Begin("reset_turns_and_errors");
  bench.Give(kId3, All({.turns = 4660, .alarms = 0x48, .status = 0x20}), false);
  bench.GiveResets(kIdC, 10, 42405, 0x20);  // errors are not reset in the replies of the sequence
  bench.PassIdle();
  bench.Give(kId3, All({.turns = 0}));
  EXPECT_EQ(bench.Last().state, CommandState::kSucceeded);
  ASSERT_EQ(bench.Last().changes.size(), 2u);
  EXPECT_EQ(bench.Last().changes[0].before, "4660");
  EXPECT_EQ(bench.Last().changes[1].before, "0x48 OF BE");
  EXPECT_EQ(bench.Last().changes[1].after, "0x00");
  EXPECT_EQ(bench.output.references_restored, 1);
  EXPECT_EQ(bench.output.jumps, 1);
  EXPECT_EQ(bench.output.non_volatile_writes, 0);
}

TEST(ResetProcedure, ABatteryThatIsStillDeadFailsTheResetAndKeepsTheReferenceLost) {
  DeviceFixture bench;
  const AllFields dead{.turns = 9, .alarms = 0x40, .status = 0x20};
  bench.GoOnline(dead);
  bench.Begin("reset_turns_and_errors");
  bench.Give(kId3, All(dead), false);
  bench.GiveResets(kIdC, 10, 42405, 0x20);
  bench.PassIdle();
  bench.Give(kId3, All({.turns = 0, .alarms = 0x40, .status = 0x20}));
  EXPECT_EQ(bench.Last().state, CommandState::kFailed);
  EXPECT_NE(bench.Last().text.find("BE"), std::string::npos);
  EXPECT_EQ(bench.output.references_restored, 0);
}

TEST(ResetProcedure, AcceptsTheTurnBesideZeroOnlyOnTheBorder) {
  struct Case {
    std::uint32_t single_turn, turns;
    CommandState state;
  };
  for (const Case& c : {Case{131'071, 65535, CommandState::kSucceeded}, Case{2, 1, CommandState::kSucceeded},
                        Case{131'071, 1, CommandState::kFailed}, Case{2, 65535, CommandState::kFailed},
                        Case{60'000, 1, CommandState::kFailed}, Case{2, 3, CommandState::kFailed}}) {
    DeviceFixture bench;
    bench.GoOnline();
    bench.Begin("reset_turns_and_errors");
    bench.Give(kId3, All({.single_turn = 0}), false);
    bench.GiveResets(kIdC, 10, 0);
    bench.PassIdle();
    bench.Give(kId3, All({.single_turn = c.single_turn, .turns = c.turns}));
    EXPECT_EQ(bench.Last().state, c.state) << c.single_turn << " " << c.turns;
  }
}

TEST(ResetProcedure, NamesWhatIsStillSetAfterClearingErrors) {
  struct Case {
    std::uint8_t after;
    CommandState state;
  };
  // OS, OF, ME, BE and CE II are latched and cleared; FS and BA are live.
  for (const Case& c :
       {Case{0x00, CommandState::kSucceeded}, Case{0x82, CommandState::kSucceeded},
        Case{0x01, CommandState::kFailed}, Case{0x04, CommandState::kFailed}, Case{0x08, CommandState::kFailed},
        Case{0x20, CommandState::kFailed}, Case{0x40, CommandState::kFailed}}) {
    DeviceFixture bench;
    bench.GoOnline();
    bench.Begin("clear_errors");
    bench.Give(kId3, All({.alarms = 0xEF}), false);
    bench.GiveResets(kId7, 10);
    bench.PassIdle();
    bench.Give(kId3, All({.alarms = c.after}));
    EXPECT_EQ(bench.Last().state, c.state);
    EXPECT_EQ(bench.Last().verified, c.state == CommandState::kSucceeded);
    EXPECT_LE(bench.Last().text.size(), 200u);
    EXPECT_EQ(bench.Last().changes.at(0).before, "0xEF OS FS CE OF ME BE BA");
    EXPECT_EQ(bench.output.references_restored, 0);
  }
}

TEST(ResetProcedure, RefusesToZeroOnADoubtfulPosition) {
  for (const std::uint8_t alarm : {std::uint8_t{0x02}, std::uint8_t{0x04}}) {
    DeviceFixture bench;
    bench.GoOnline();
    bench.Begin("zero_single_turn");
    bench.Give(kId3, All({.alarms = alarm}), false);
    EXPECT_EQ(bench.Last().state, CommandState::kRejected);
    EXPECT_EQ(bench.Last().reason, Reason::REASON_DEVICE_ALARM);
  }
}

}  // namespace
}  // namespace axlecast::tformat
