#include <gtest/gtest.h>
#include <algorithm>
#include <axlecast/command_status_t.hpp>

#include "core/device/operation.h"
#include "drivers/tformat/device_test_support.h"
#include "drivers/tformat/operations.h"

// No operation claims an effect that its read-back would have shown without it (docs/commands.md).

namespace axlecast::tformat {

namespace {

using Reason = command_status_t;

TEST(Operations, EachHasAVerificationAndEachChangeAWayToFindIt) {
  for (const OperationSpec& spec : Operations()) {
    EXPECT_LE(spec.name.size(), 24u);
    EXPECT_FALSE(spec.help.empty());
    EXPECT_FALSE(spec.verification.empty());
    if (spec.reads_only) continue;
    const auto found = std::find_if(Operations().begin(), Operations().end(), [&](const OperationSpec& other) {
      return other.name == spec.verified_by_operation;
    });
    ASSERT_NE(found, Operations().end()) << spec.name;
    EXPECT_TRUE(std::any_of(found->arguments.begin(), found->arguments.end(), [](const ArgumentSpec& argument) {
      return argument.name == "after" && !argument.required;
    }));
  }
}

TEST(Operations, ReadoutsShowWhatTheEncoderSays) {
  DeviceFixture bench;
  bench.GoOnline();
  bench.Begin("read_all");
  bench.Give(kId3, All({.single_turn = 42405, .turns = 34952, .alarms = 0x80, .status = 0x20}), false);
  EXPECT_EQ(bench.Last().state, CommandState::kSucceeded);
  EXPECT_NE(bench.Last().text.find("42405"), std::string::npos);
  EXPECT_NE(bench.Last().text.find("34952"), std::string::npos);
  EXPECT_NE(bench.Last().text.find("0x80 BA"), std::string::npos);
  EXPECT_LE(bench.Last().changes.size(), 4u);
  bench.Begin("read_turns");
  bench.Give(kId1, Short(kId1, 34952), false);
  EXPECT_EQ(bench.Last().changes.at(0).after, "34952");
  bench.Begin("read_identity");
  bench.Give(kId2, Checked({0x92, 0x00, 0x11}), false);
  EXPECT_EQ(bench.Last().changes.at(0).after, "0x11");
  bench.Begin("read_identity");
  bench.Give(kId2, Checked({0x92, 0x00, 0x17}), false);
  EXPECT_EQ(bench.Last().changes.at(0).after, "0x17");
}

TEST(Operations, AReadoutIsRepeatedTwiceThenFails) {
  DeviceFixture bench;
  bench.GoOnline();
  bench.Begin("read_turns");
  for (int i = 0; i < 3; ++i) {
    bench.Give(kId1, {0x8A}, false);
    bench.PassSilence();
  }
  EXPECT_EQ(bench.Last().state, CommandState::kFailed);
  EXPECT_EQ(bench.Last().reason, Reason::REASON_NO_REPLY);
}

TEST(Operations, ReadAllFindsTheEffectOfAReset) {
  struct Case {
    const char* after;
    AllFields reads;
    bool rests;
    const char* finding;
  };
  for (const Case& c : {Case{"zero_single_turn", {.single_turn = 10}, true, "reads_as_after"},
                        Case{"zero_single_turn", {.single_turn = 1000}, true, "no_effect_seen"},
                        Case{"zero_single_turn", {.single_turn = 1000}, false, "cannot_tell"},
                        Case{"reset_turns_and_errors", {.turns = 0}, true, "reads_as_after"},
                        Case{"reset_turns_and_errors", {.turns = 7}, true, "no_effect_seen"},
                        Case{"clear_errors", {.alarms = 0x82}, false, "reads_as_after"},
                        Case{"reset_turns_and_errors", {.turns = 0, .alarms = 0x08}, true, "cannot_tell"},
                        Case{"clear_errors", {.alarms = 0x08}, true, "cannot_tell"}}) {
    DeviceFixture bench;
    bench.GoOnline();
    bench.output.motion = [&](MonoNs) { return Motion{.known = true, .standstill = c.rests}; };
    bench.Begin("read_all", {{"after", c.after}});
    bench.Give(kId3, All(c.reads), false);
    EXPECT_EQ(bench.Last().changes.back().key, "finding");
    EXPECT_EQ(bench.Last().changes.back().after, c.finding) << c.after;
    EXPECT_LE(bench.Last().changes.size(), 4u);
  }
  DeviceFixture bench;
  bench.GoOnline();
  bench.Begin("read_all", {{"after", "eeprom_write address=1 data=00"}});
  EXPECT_EQ(bench.Last().reason, Reason::REASON_BAD_ARGUMENT);
}

TEST(Operations, AreRejectedWhenTheEncoderIsNotThere) {
  DeviceFixture bench;
  bench.Begin("read_all");
  EXPECT_EQ(bench.Last().reason, Reason::REASON_DEVICE_OFFLINE);
  bench.LinkUp();
  bench.Begin("read_all");
  EXPECT_EQ(bench.Last().reason, Reason::REASON_DEVICE_OFFLINE);
  EXPECT_EQ(bench.Last().state, CommandState::kRejected);
}

TEST(Operations, OnlyReadingsAreDoneOnAnotherEncoder) {
  DeviceFixture bench("{model: ts5669n127, eeprom_writable: [0]}");
  bench.LinkUp();
  bench.PassSilence();
  for (int i = 0; i < 3; ++i) bench.Give(kId3, All({.encoder_id = 0x17}));
  for (const char* operation : {"zero_single_turn", "reset_turns_and_errors", "clear_errors", "eeprom_write"}) {
    bench.Begin(operation, {{"address", "0"}, {"data", "01"}});
    EXPECT_EQ(bench.Last().reason, Reason::REASON_WRONG_IDENTITY) << operation;
  }
  bench.Begin("read_identity");
  bench.Give(kId2, Checked({0x92, 0x00, 0x17}), false);
  EXPECT_EQ(bench.Last().state, CommandState::kSucceeded);
}

TEST(Operations, WaitForTheIdentityTag) {
  DeviceFixture bench("{model: ts5669n127, identity: {eeprom_address: 0, bytes: \"A1\"}}");
  bench.LinkUp();
  bench.PassSilence();
  bench.Give(kId3, All());
  bench.Begin("clear_errors");
  EXPECT_EQ(bench.Last().state, CommandState::kRejected);
  EXPECT_EQ(bench.Last().reason, Reason::REASON_DEVICE_OFFLINE);
}

TEST(Operations, AreRefusedWithTheInterlockThatForbidsThem) {
  DeviceFixture bench("{model: ts5669n127, eeprom_writable: [0]}");
  bench.GoOnline({.alarms = 0x04});
  const auto refusal = [&](const char* operation, Arguments arguments = {}) {
    DriverCommand order;
    order.operation = operation;
    order.arguments = std::move(arguments);
    const Result<> valid = bench.device->Validate(order, bench.now);
    return valid ? Outcome{} : RefusedOutcome(valid.error());
  };
  EXPECT_EQ(refusal("zero_single_turn").reason, Reason::REASON_DEVICE_ALARM);
  EXPECT_NE(refusal("zero_single_turn").text.find("ALMC 0x04"), std::string::npos);
  EXPECT_EQ(refusal("reset_turns_and_errors").reason, Reason::REASON_NONE);
  EXPECT_EQ(refusal("clear_errors").reason, Reason::REASON_NONE);
  bench.output.motion = [](MonoNs) { return Motion{.known = true, .speed_rpm = 3}; };
  EXPECT_NE(refusal("reset_turns_and_errors").text.find("3 rpm"), std::string::npos);
  EXPECT_EQ(refusal("clear_errors").reason, Reason::REASON_NONE);
  EXPECT_EQ(refusal("eeprom_write", {{"address", "0"}, {"data", "01"}}).reason, Reason::REASON_NONE);
  EXPECT_NE(refusal("eeprom_write", {{"address", "0"}, {"data", "01 02"}}).text.find("address 1 "),
            std::string::npos);
  EXPECT_EQ(refusal("eeprom_write", {{"address", "80"}, {"data", "01"}}).reason, Reason::REASON_BAD_ARGUMENT);
  EXPECT_EQ(refusal("eeprom_read", {{"address", "79"}, {"count", "2"}}).reason, Reason::REASON_BAD_ARGUMENT);
  EXPECT_TRUE(bench.output.outcomes.empty());
}

TEST(Operations, OneAtATimeAndOnlyInTime) {
  DeviceFixture bench;
  bench.GoOnline();
  bench.Begin("read_all");
  bench.Begin("read_turns");
  EXPECT_EQ(bench.Last().reason, Reason::REASON_BUSY);
  bench.Give(kId3, All(), false);
  EXPECT_EQ(bench.Last().state, CommandState::kSucceeded);
  bench.Begin("read_all", {}, bench.now - 1);
  EXPECT_EQ(bench.Last().state, CommandState::kExpired);
}

TEST(Operations, ExpireWhenTheLineStaysUnclear) {
  DeviceFixture bench;
  bench.GoOnline();
  bench.Stray({0});
  bench.Begin("zero_single_turn", {}, bench.now + 1 * kMillisecond);
  bench.now += 10 * kMillisecond;
  bench.PassSilence();
  EXPECT_EQ(bench.Last().state, CommandState::kExpired);
  EXPECT_EQ(bench.FinalOutcomes(), 1);
  EXPECT_TRUE(bench.IsIdle(false));
}

TEST(Operations, UnknownOnesAreNamed) {
  DeviceFixture bench;
  bench.GoOnline();
  bench.Begin("id7");
  EXPECT_EQ(bench.Last().reason, Reason::REASON_UNKNOWN_OPERATION);
}

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

// Before the tenth request, the bridge receives what a look would have found before.
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
