// No operation claims an effect that its read-back would have shown without it (docs/commands.md).
#include <gtest/gtest.h>

#include "drivers/tformat/device_test_support.h"

namespace axlecast::tformat {
namespace {

struct Case {
  const char* operation;
  ByteList request;
  AllFields before;
  AllFields after;
  bool tenth_reply;
  CommandState state;
  bool verified;
};

constexpr CommandState kSucceeded = CommandState::kSucceeded;
constexpr CommandState kIndeterminate = CommandState::kIndeterminate;

TEST(VerifiedOutcome, AResetIsVerifiedOnlyWhereItsEffectCanBeSeen) {
  const AllFields zero{.single_turn = 0, .turns = 0};
  const std::vector<Case> cases = {
      {"zero_single_turn", kId8, {.single_turn = 1000}, zero, true, kSucceeded, true},
      {"zero_single_turn", kId8, {.single_turn = 1000}, zero, false, kSucceeded, true},
      {"zero_single_turn", kId8, {.single_turn = 3}, zero, true, kSucceeded, false},
      {"zero_single_turn", kId8, {.single_turn = 131'071}, zero, true, kSucceeded, false},
      {"zero_single_turn", kId8, {.single_turn = 128}, {.single_turn = 127}, true, kSucceeded, false},
      {"zero_single_turn", kId8, {.single_turn = 3}, zero, false, kIndeterminate, false},
      {"reset_turns_and_errors", kIdC, {.turns = 3}, zero, true, kSucceeded, true},
      {"reset_turns_and_errors", kIdC, {.turns = 0, .alarms = 0x08}, zero, true, kSucceeded, true},
      {"reset_turns_and_errors", kIdC, {.turns = 0}, zero, true, kSucceeded, false},
      {"reset_turns_and_errors", kIdC, {.turns = 0, .alarms = 0x80}, zero, true, kSucceeded, false},
      {"reset_turns_and_errors", kIdC, {.turns = 0}, zero, false, kIndeterminate, false},
      {"clear_errors", kId7, {.alarms = 0x08}, {}, true, kSucceeded, true},
      {"clear_errors", kId7, {}, {}, true, kSucceeded, false},
      {"clear_errors", kId7, {.alarms = 0x80}, {}, true, kSucceeded, false},
      {"clear_errors", kId7, {.alarms = 0x80}, {}, false, kIndeterminate, false},
  };
  for (const Case& c : cases) {
    DeviceFixture bench;
    bench.GoOnline();
    bench.Begin(c.operation);
    bench.Give(kId3, All(c.before), false);
    bench.GiveResets(c.request, 9, c.before.single_turn);
    bench.PassIdle();
    bench.Give(c.request, c.tenth_reply ? Short(c.request, c.before.single_turn) : ByteList{});
    if (!c.tenth_reply) bench.PassSilence();
    bench.PassIdle();
    bench.Give(kId3, All(c.after));
    EXPECT_EQ(bench.Last().state, c.state) << c.operation << ": " << bench.Last().text;
    EXPECT_EQ(bench.Last().verified, c.verified) << c.operation << ": " << bench.Last().text;
    EXPECT_LE(bench.Last().text.size(), 200u);
  }
}

// The bridge is told before the tenth request what a look would have found before.
TEST(VerifiedOutcome, ProgressTellsWhetherAnEffectCouldBeSeen) {
  for (const auto& [single_turn, word] : {std::pair{1000U, "no_effect_seen"}, {3U, "reads_as_after"}}) {
    DeviceFixture bench;
    bench.GoOnline();
    bench.Begin("zero_single_turn");
    bench.Give(kId3, All({.single_turn = single_turn}), false);
    bench.GiveResets(kId8, 1, single_turn);
    ASSERT_EQ(bench.Last().changes.size(), 4u);
    EXPECT_EQ(bench.Last().changes[3].key, "finding");
    EXPECT_EQ(bench.Last().changes[3].before, word);
  }
}

TEST(VerifiedOutcome, CellsThatHeldTheirValuesAreNamedSo) {
  DeviceFixture bench("{model: ts5669n127, eeprom_writable: [10, 11]}");
  bench.GoOnline();
  bench.Begin("eeprom_write", {{"address", "10"}, {"data", "0A 0B"}});
  for (std::uint8_t cell = 0; cell < 80; ++cell) {
    bench.Give(Checked({0xEA, cell}), Cell(cell, cell), false);
  }
  EXPECT_EQ(bench.Last().state, CommandState::kSucceeded);
  EXPECT_NE(bench.Last().text.find("held these values already: nothing was written"), std::string::npos);
  EXPECT_EQ(bench.output.non_volatile_writes, 0);
}

}  // namespace
}  // namespace axlecast::tformat
