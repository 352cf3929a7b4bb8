#include "bridge/state/device_state.h"

#include <gtest/gtest.h>

#include <axlecast/device_info_t.hpp>
#include <cmath>
#include <string>
#include <utility>
#include <vector>

#include "bridge/store/memory_store_fixture.h"
#include "core/command/commands.h"
#include "tests/support/counting_family.h"

namespace axlecast {
namespace {

using S = command_status_t;
using Verdict = ShaftTravel::Verdict;
using Arguments = std::vector<std::pair<std::string, std::string>>;

constexpr std::int64_t kTurn = 8'000;  // counts
constexpr std::int64_t kWindow = 16 * kTurn;
constexpr std::int64_t kBoot = 7;

DeviceConfig Axis(std::int64_t turns_range = 16, std::int64_t noise = 0, std::int64_t budget = 0) {
  auto settings = std::make_shared<DeviceSettings>();
  settings->counts_per_turn = kTurn;
  settings->turns_range = turns_range;
  settings->noise_counts = noise;
  settings->write_budget = budget;
  DeviceConfig device;
  device.name = "axis1";
  device.settings = settings;
  return device;
}

// ---- how far a shaft moved ----

TEST(ShaftTravel, AThousandthOfATurnIsRest) {
  for (const std::int64_t sign : {1, -1}) {
    EXPECT_EQ(Travelled(Axis(), 500, 500 + sign * 8).verdict, Verdict::kResting);
    EXPECT_EQ(Travelled(Axis(), 500, 500 + sign * 9).verdict, Verdict::kWithinWindow);
  }
}

TEST(ShaftTravel, TheNoiseOfTwoReadingsIsRest) {
  EXPECT_EQ(Travelled(Axis(16, 10), 0, 20).verdict, Verdict::kResting);
  EXPECT_EQ(Travelled(Axis(16, 10), 0, 21).verdict, Verdict::kWithinWindow);
  EXPECT_EQ(Travelled(Axis(16, 1), 0, 8).verdict, Verdict::kResting) << "less noise than a thousandth of a turn";
}

TEST(ShaftTravel, IsTheShortestWay) {
  EXPECT_EQ(Travelled(Axis(), 0, kWindow - 1).counts, -1);
  EXPECT_EQ(Travelled(Axis(), 0, 1 - kWindow).counts, 1);
  EXPECT_EQ(Travelled(Axis(), 0, 3 * kWindow + 5).counts, 5);
  EXPECT_EQ(Travelled(Axis(), 0, -3 * kWindow - 5).counts, -5);
  EXPECT_EQ(Travelled(Axis(), 700, 100).counts, -600);
  EXPECT_EQ(Travelled(Axis(), 0, kWindow / 2).counts, kWindow / 2);
  EXPECT_EQ(Travelled(Axis(), 0, kWindow / 2 + 1).counts, 1 - kWindow / 2);
}

TEST(ShaftTravel, IsTrustedUpToAQuarterOfTheTurns) {
  for (const std::int64_t sign : {1, -1}) {
    const ShaftTravel quarter = Travelled(Axis(), 0, sign * 4 * kTurn);
    EXPECT_EQ(quarter.verdict, Verdict::kWithinWindow);
    EXPECT_DOUBLE_EQ(quarter.turns, static_cast<double>(sign) * 4);
    EXPECT_EQ(Travelled(Axis(), 0, sign * (4 * kTurn + 1)).verdict, Verdict::kBeyondWindow);
  }
  EXPECT_EQ(Travelled(Axis(2), 0, kTurn / 2).verdict, Verdict::kWithinWindow) << "two turns are multi-turn";
}

TEST(ShaftTravel, ASingleTurnEncoderSeesNoTurns) {
  for (const std::int64_t turns_range : {0, 1}) {
    EXPECT_EQ(Travelled(Axis(turns_range), 0, 100).verdict, Verdict::kTurnsUnknown);
    EXPECT_EQ(Travelled(Axis(turns_range), 0, kTurn - 100).counts, -100);
    EXPECT_EQ(Travelled(Axis(turns_range), 0, 5 * kTurn).verdict, Verdict::kResting);
  }
}

TEST(ShaftTravel, IsToldWithTurnsAndTime) {
  const auto text = [](std::int64_t turns_range, std::int64_t after) {
    const DeviceConfig device = Axis(turns_range);
    return TravelText(Travelled(device, 0, after), device, 12'300'000);
  };
  EXPECT_EQ(text(16, 0), "did not move in the 12.3 s without its driver");
  EXPECT_EQ(text(16, 2 * kTurn),
            "moved by 2.0000 turns in the 12.3 s without its driver; the encoder distinguishes 16 turns");
  EXPECT_EQ(
      text(16, -6 * kTurn),
      "moved by -6.0000 turns or further in the 12.3 s without its driver: more than a quarter of the 16 turns "
      "that the encoder distinguishes; check its place");
  EXPECT_EQ(
      text(1, kTurn / 4),
      "its angle changed by 0.2500 turns in the 12.3 s without its driver, besides any number of whole turns: a "
      "single-turn encoder cannot detect them; check its place");
}

// ---- what is kept of an axis ----

driver_device_t At(std::int64_t position, const std::string& identity = "17") {
  driver_device_t reported{};
  reported.device = "axis1";
  reported.state = device_info_t::STATE_ONLINE;
  reported.identity = identity;
  reported.has_position = 1;
  reported.position = position;
  reported.position_utime = 1'000'000'000;
  return reported;
}

driver_device_t Lost(bool lost) {
  driver_device_t reported = At(0);
  reported.reference_lost = lost ? 1 : 0;
  return reported;
}

// An axis of which the bridge has a record, and whose driver sends HELLO.
class AxisStateTest : public testing::Test {
 protected:
  std::optional<BridgeCommand> Hello(const driver_device_t& reported, std::int64_t boot = kBoot, bool idle = true) {
    return axes_.OnHello(device_, reported, boot, idle, now_);
  }
  void Have(const DeviceChange& change) { ASSERT_TRUE(store_.Apply("axis1", change)); }
  void HavePosition(std::int64_t counts) { store_.KeepPosition("axis1", {counts, 990'000'000}); }
  AxisRecord Record() { return store_.Find("axis1"); }
  // The kinds of events so far; each is stored and reported.
  std::vector<std::string> Kinds() {
    std::vector<std::string> kinds;
    for (const AxisEvent& event : events_) kinds.push_back(event.kind);
    EXPECT_EQ(store_.events.size(), events_.size());
    return kinds;
  }
  static Arguments ArgumentsOf(const std::vector<argument_t>& arguments) {
    Arguments pairs;
    for (const argument_t& argument : arguments) pairs.emplace_back(argument.key, argument.value);
    return pairs;
  }
  PendingCommand Command(const std::string& operation, std::int8_t state = S::STATE_SUCCEEDED) {
    PendingCommand pending;
    pending.id = NumberedId(0x21);
    pending.device = "axis1";
    pending.operation = FindOperation(CountingFamily(), operation);
    pending.who = "anna";
    pending.reason = "new coupling";
    pending.status.operation = operation;
    pending.status.state = state;
    return pending;
  }
  void End(PendingCommand& pending) { axes_.OnOutcome(device_, pending, now_); }

  Timestamp now_{50 * kSecond, 1'001'000'000};
  DeviceConfig device_ = Axis();
  MemoryStore store_;
  std::vector<AxisEvent> events_;
  AxisStateStore axes_{store_, [this](const AxisEvent& event) { events_.push_back(event); }};
};

using Names = std::vector<std::string>;

TEST_F(AxisStateTest, ThePositionOfADeviceThatAnswersIsKept) {
  driver_device_t reported = At(300);
  reported.state = device_info_t::STATE_OFFLINE;
  Hello(reported);
  EXPECT_FALSE(Record().position);
  reported.state = device_info_t::STATE_ONLINE;
  reported.has_position = 0;
  Hello(reported);
  EXPECT_FALSE(Record().position);
  reported.has_position = 1;
  Hello(reported);
  ASSERT_TRUE(Record().position);
  EXPECT_EQ(Record().position->counts, 300);
  EXPECT_EQ(Record().position->utime, 1'000'000'000);
  reported.state = device_info_t::STATE_DEGRADED;
  reported.position = 400;
  Hello(reported);
  EXPECT_EQ(Record().position->counts, 400);
}

TEST_F(AxisStateTest, ARestartedDriverIsGivenTheDatumBack) {
  EXPECT_FALSE(Hello(At(0))) << "no datum was set";
  Have(DatumRecord{.counts = -42, .utime = 900'000'000, .identity = "17"});
  const auto given = Hello(At(0));
  ASSERT_TRUE(given);
  EXPECT_EQ(given->operation, "set_datum");
  EXPECT_EQ(ArgumentsOf(given->arguments),
            (Arguments{{"counts", "-42"}, {"utime", "900000000"}, {"identity", "17"}}));
  EXPECT_TRUE(Hello(At(0))) << "again, until the driver has it";
  EXPECT_FALSE(Hello(At(0), kBoot, false)) << "another command is in progress";
  driver_device_t reported = At(0);
  reported.has_datum = 1;
  EXPECT_TRUE(Hello(reported)) << "the datum of the file counts less";
  reported.datum_utime = 900'000'000;
  EXPECT_FALSE(Hello(reported));
  EXPECT_FALSE(Hello(At(0))) << "it had one: somebody has cleared it";
  EXPECT_TRUE(Hello(At(0), kBoot + 1));
}

TEST_F(AxisStateTest, ADatumWithoutIdentityIsGivenToEveryEncoder) {
  Have(DatumRecord{.counts = 5, .utime = 6});
  const auto given = Hello(At(0));
  ASSERT_TRUE(given);
  EXPECT_EQ(ArgumentsOf(given->arguments), (Arguments{{"counts", "5"}, {"utime", "6"}}));
}

TEST_F(AxisStateTest, AnotherEncoderIsReportedOnceAndGetsNoDatum) {
  Have(IdentityChanged{"16"});
  Have(DatumRecord{.counts = 5});
  HavePosition(0);
  for (const std::int64_t boot : {kBoot, kBoot, kBoot + 1}) {
    EXPECT_FALSE(Hello(At(9'000), boot));
    EXPECT_TRUE(axes_.AnyExchanged());
    EXPECT_EQ(Kinds().size(), 1U) << "with the first HELLO, boot " << boot;
  }
  ASSERT_EQ(Kinds(), Names{"encoder_exchanged"});
  EXPECT_EQ(events_[0].text,
            "another encoder answers: 17 in the place of 16; its datum is not given to it: axlecast replace axis1");
  EXPECT_EQ(events_[0].device, "axis1");
  EXPECT_EQ(events_[0].utime, now_.utime);
  EXPECT_EQ(Record().position->counts, 0) << "the position of the other encoder stays";
  EXPECT_EQ(Record().identity, "16");
  EXPECT_TRUE(Hello(At(0, "16"), kBoot + 2)) << "the first one is back";
  EXPECT_FALSE(axes_.AnyExchanged());
}

TEST_F(AxisStateTest, WithoutAnIdentityNoExchangeIsSeen) {
  Hello(At(0, ""));
  EXPECT_EQ(Record().identity, "");
  Hello(At(0, "17"), kBoot + 1);
  EXPECT_EQ(Record().identity, "17") << "the first identity is kept";
  Hello(At(0, ""), kBoot + 2);
  EXPECT_EQ(Record().identity, "17");
  EXPECT_FALSE(axes_.AnyExchanged());
  EXPECT_TRUE(Kinds().empty());
}

TEST_F(AxisStateTest, AMoveWithoutTheDriverIsReportedOnce) {
  HavePosition(0);
  Hello(At(2 * kTurn));
  Hello(At(4 * kTurn));
  ASSERT_EQ(Kinds(), Names{"moved_while_away"});
  EXPECT_EQ(events_[0].text,
            "moved by 2.0000 turns in the 10.0 s without its driver; the encoder distinguishes 16 turns");
  EXPECT_FALSE(axes_.AnyDoubtful());
}

TEST_F(AxisStateTest, AShaftAtRestIsNoEvent) {
  HavePosition(0);
  Hello(At(8));
  EXPECT_TRUE(Kinds().empty());
  EXPECT_FALSE(axes_.AnyDoubtful());
}

TEST_F(AxisStateTest, AMoveBeyondTheTurnsIsDoubtfulUntilADatumIsSet) {
  HavePosition(0);
  Hello(At(6 * kTurn));
  EXPECT_TRUE(axes_.AnyDoubtful());
  Hello(At(6 * kTurn), kBoot + 1);
  EXPECT_TRUE(axes_.AnyDoubtful()) << "another restart does not end the doubt";
  PendingCommand set = Command("set_datum");
  set.status.changes = {{"datum_counts", "", "48000"}};
  End(set);
  EXPECT_FALSE(axes_.AnyDoubtful());
}

TEST_F(AxisStateTest, AMonitorHasNoShaft) {
  device_.settings = nullptr;
  HavePosition(0);
  Hello(At(6 * kTurn));
  EXPECT_TRUE(Kinds().empty());
}

TEST_F(AxisStateTest, ALostReferenceIsKeptUntilTheDriverReportsIt) {
  EXPECT_FALSE(Hello(Lost(true)));
  EXPECT_FALSE(Hello(Lost(true)));
  EXPECT_TRUE(Record().reference_lost);
  EXPECT_TRUE(Record().position) << "the position is kept nevertheless";
  ASSERT_EQ(Kinds(), Names{"reference_lost"});
  EXPECT_EQ(events_[0].text, "its driver reports that the reference is lost");
  Hello(Lost(false));
  EXPECT_FALSE(Record().reference_lost);
  ASSERT_EQ(Kinds(), (Names{"reference_lost", "reference_restored"}));
  EXPECT_EQ(events_[1].text, "the reference holds again");
  EXPECT_FALSE(Hello(Lost(false)));
  EXPECT_EQ(Kinds().size(), 2U);
}

TEST_F(AxisStateTest, ARestartedDriverLearnsThatTheReferenceWasLost) {
  Have(ReferenceChanged{true});
  const auto given = Hello(Lost(false));
  ASSERT_TRUE(given);
  EXPECT_EQ(given->operation, "mark_reference_lost");
  EXPECT_TRUE(given->arguments.empty());
  EXPECT_TRUE(Record().reference_lost) << "this driver cannot know";
  EXPECT_FALSE(Hello(Lost(true)));
  EXPECT_TRUE(Kinds().empty()) << "it was reported before";
  EXPECT_FALSE(Hello(Lost(false)));
  EXPECT_FALSE(Record().reference_lost);
  EXPECT_EQ(Kinds(), Names{"reference_restored"});
}

TEST_F(AxisStateTest, AChangeThatTheJournalDoesNotTakeIsNoEventYet) {
  store_.fails = true;
  Hello(Lost(true));
  EXPECT_TRUE(Kinds().empty());
  store_.fails = false;
  Hello(Lost(true));
  EXPECT_EQ(Kinds(), Names{"reference_lost"});
  store_.fails = true;
  Hello(Lost(false));
  EXPECT_EQ(Kinds().size(), 1U);
}

// ---- wear ----

std::int32_t ThreeWrites(const axlecast::Arguments& /*arguments*/) { return 3; }
std::int32_t OneWrite(const axlecast::Arguments& /*arguments*/) { return 1; }
std::int32_t NoWrites(const axlecast::Arguments& /*arguments*/) { return 0; }
const OperationSpec kWrite = {.name = "write", .help = "writes", .writes = &ThreeWrites};
const OperationSpec kHome = {.name = "home", .help = "moves the origin", .moves_datum = true};

TEST_F(AxisStateTest, WritesAreCountedBeforeTheyAreMade) {
  PendingCommand pending = Command("set_datum");
  pending.operation = &kWrite;
  ASSERT_TRUE(axes_.BeforeRoute(device_, pending, now_));
  EXPECT_EQ(Record().writes, 3);
  EXPECT_EQ(Record().since_utime, now_.utime);
  EXPECT_EQ(pending.reserved_writes, 3);
  pending.nv_writes = 1;
  pending.status.state = S::STATE_FAILED;
  End(pending);
  EXPECT_EQ(Record().writes, 1) << "two were not made";
  End(pending);
  EXPECT_EQ(Record().writes, 1);
}

TEST_F(AxisStateTest, AlsoASingleWriteIsCountedAndTakenBack) {
  const OperationSpec once = {.name = "write", .help = "writes once", .writes = &OneWrite};
  PendingCommand pending = Command("set_datum", S::STATE_FAILED);
  pending.operation = &once;
  ASSERT_TRUE(axes_.BeforeRoute(device_, pending, now_));
  EXPECT_EQ(Record().writes, 1);
  EXPECT_EQ(pending.reserved_writes, 1);
  End(pending);
  EXPECT_EQ(Record().writes, 0) << "it was not made";
}

TEST_F(AxisStateTest, WritesOfACommandWithoutOutcomeStayCounted) {
  PendingCommand pending = Command("set_datum", S::STATE_INDETERMINATE);
  pending.operation = &kWrite;
  ASSERT_TRUE(axes_.BeforeRoute(device_, pending, now_));
  End(pending);
  EXPECT_EQ(Record().writes, 3);
}

TEST_F(AxisStateTest, MoreWritesThanExpectedTakeNothingAway) {
  Have(WritesAdded{10, 1});
  PendingCommand pending = Command("set_datum", S::STATE_FAILED);
  pending.operation = &kWrite;
  ASSERT_TRUE(axes_.BeforeRoute(device_, pending, now_));
  pending.nv_writes = 5;
  End(pending);
  EXPECT_EQ(Record().writes, 13);
}

TEST_F(AxisStateTest, TheMakersBudgetIsNotExceeded) {
  device_ = Axis(16, 0, 10);
  Have(WritesAdded{7, 1});
  PendingCommand pending = Command("set_datum");
  pending.operation = &kWrite;
  EXPECT_TRUE(axes_.BeforeRoute(device_, pending, now_)) << "the tenth";
  pending.operation = &kWrite;
  const auto refused = axes_.BeforeRoute(device_, pending, now_);
  ASSERT_FALSE(refused);
  EXPECT_EQ(refused.error().reason, S::REASON_WEAR);
  EXPECT_EQ(refused.error().text,
            "its memory has had 10 of the 10 writes that the maker allows: exchange it (axlecast replace axis1)");
  EXPECT_EQ(Record().writes, 10);
}

TEST_F(AxisStateTest, ABudgetOfOneWriteIsNotExceeded) {
  device_ = Axis(16, 0, 1);
  PendingCommand pending = Command("set_datum");
  pending.operation = &kWrite;
  EXPECT_EQ(axes_.BeforeRoute(device_, pending, now_).error().reason, S::REASON_WEAR);
  EXPECT_EQ(Record().writes, 0);
}

TEST_F(AxisStateTest, WithoutABudgetWritesHaveNoEnd) {
  Have(WritesAdded{1'000'000, 1});
  PendingCommand pending = Command("set_datum");
  pending.operation = &kWrite;
  EXPECT_TRUE(axes_.BeforeRoute(device_, pending, now_));
  device_.settings = nullptr;
  EXPECT_TRUE(axes_.BeforeRoute(device_, pending, now_));
}

TEST_F(AxisStateTest, WhatIsOnlyPreparedIsCheckedButNotCounted) {
  device_ = Axis(16, 0, 4);
  PendingCommand pending = Command("set_datum");
  pending.operation = &kWrite;
  pending.prepare = true;
  pending.reserved_writes = 9;
  store_.fails = true;
  EXPECT_TRUE(axes_.BeforeRoute(device_, pending, now_));
  EXPECT_EQ(pending.reserved_writes, 0);
  store_.fails = false;
  EXPECT_EQ(Record().writes, 0);
  Have(WritesAdded{2, 1});
  EXPECT_EQ(axes_.BeforeRoute(device_, pending, now_).error().reason, S::REASON_WEAR);
}

TEST_F(AxisStateTest, AWriteThatCannotBeCountedIsNotMade) {
  store_.fails = true;
  PendingCommand pending = Command("set_datum");
  pending.operation = &kWrite;
  const auto refused = axes_.BeforeRoute(device_, pending, now_);
  ASSERT_FALSE(refused);
  EXPECT_EQ(refused.error().reason, S::REASON_JOURNAL);
  EXPECT_EQ(refused.error().text, "the journal cannot note what it changes: see ALARM/bridge; nothing was done");
  const OperationSpec none = {.name = "write", .help = "writes nothing", .writes = &NoWrites};
  pending.operation = &none;
  EXPECT_TRUE(axes_.BeforeRoute(device_, pending, now_)) << "nothing is to be counted";
}

// ---- datums ----

TEST_F(AxisStateTest, ADatumIsKeptWithAllThatIsKnownOfIt) {
  PendingCommand set = Command("set_datum");
  set.arguments = {{"value", "1.5"}, {"utime", "123"}};
  set.status.changes = {{"datum_counts", "", "-77"}, {"identity", "", "17"}, {"value", "0.2 m", "1.5 m"}};
  End(set);
  const auto datum = Record().datum;
  ASSERT_TRUE(datum);
  EXPECT_EQ(datum->counts, -77);
  EXPECT_EQ(datum->utime, 123);
  EXPECT_EQ(datum->identity, "17");
  EXPECT_EQ(datum->value, "1.5 m");
  EXPECT_EQ(datum->who, "anna");
  EXPECT_EQ(datum->reason, "new coupling");
  EXPECT_EQ(datum->command, NumberedId(0x21));
  EXPECT_EQ(set.status.text, "");
}

TEST_F(AxisStateTest, ADatumWithoutATimeIsOfNow) {
  PendingCommand set = Command("set_datum");
  set.status.changes = {{"datum_counts", "", "1"}};
  End(set);
  ASSERT_TRUE(Record().datum);
  EXPECT_EQ(Record().datum->utime, now_.utime);
}

TEST_F(AxisStateTest, OnlyADatumThatWasSetIsKept) {
  PendingCommand set = Command("set_datum", S::STATE_FAILED);
  set.status.changes = {{"datum_counts", "", "1"}};
  End(set);
  EXPECT_FALSE(Record().datum);
  set.status.state = S::STATE_SUCCEEDED;
  set.prepare = true;
  End(set);
  EXPECT_FALSE(Record().datum);
  set.prepare = false;
  set.status.changes[0].key = "counts";
  End(set);
  EXPECT_FALSE(Record().datum) << "the driver does not name the counts";
  set.operation = nullptr;
  End(set);
  EXPECT_FALSE(Record().datum);
  EXPECT_TRUE(store_.Datums("axis1").empty());
}

TEST_F(AxisStateTest, ADatumThatTheJournalDoesNotTakeIsToldInItsOutcome) {
  store_.fails = true;
  PendingCommand set = Command("set_datum");
  set.status.text = "done";
  set.status.changes = {{"datum_counts", "", "1"}};
  End(set);
  EXPECT_EQ(set.status.text, "done; the journal could not keep it: it is lost when the driver ends");
}

TEST_F(AxisStateTest, ADatumThatWasClearedIsVoid) {
  Have(DatumRecord{.counts = 5});
  PendingCommand clear = Command("clear_datum", S::STATE_REJECTED);
  End(clear);
  EXPECT_TRUE(Record().datum);
  clear.status.state = S::STATE_SUCCEEDED;
  End(clear);
  EXPECT_FALSE(Record().datum);
  EXPECT_EQ(store_.Datums("axis1")[0].void_reason, "undone");
  EXPECT_EQ(store_.Datums("axis1")[0].voided_utime, now_.utime);
}

TEST_F(AxisStateTest, AMovedOriginMakesTheDatumVoidBeforeItIsSent) {
  Have(DatumRecord{.counts = 5});
  PendingCommand home = Command("home");
  home.operation = &kHome;
  home.prepare = true;
  ASSERT_TRUE(axes_.BeforeRoute(device_, home, now_));
  EXPECT_TRUE(Record().datum) << "it is only prepared";
  home.prepare = false;
  ASSERT_TRUE(axes_.BeforeRoute(device_, home, now_));
  EXPECT_FALSE(Record().datum);
  EXPECT_EQ(store_.Datums("axis1")[0].voided_utime, now_.utime);
  EXPECT_EQ(store_.Datums("axis1")[0].void_reason, "home 21000000000000000000000000000000");
}

TEST_F(AxisStateTest, AnOriginIsMovedOnlyIfTheJournalTakesIt) {
  PendingCommand home = Command("home");
  home.operation = &kHome;
  store_.fails = true;
  EXPECT_TRUE(axes_.BeforeRoute(device_, home, now_)) << "nothing is known that becomes void";
  HavePosition(3);
  EXPECT_EQ(axes_.BeforeRoute(device_, home, now_).error().reason, S::REASON_JOURNAL);
  store_.fails = false;
  ASSERT_TRUE(axes_.BeforeRoute(device_, home, now_));
  EXPECT_FALSE(Record().position) << "it was counted from the origin before";
}

TEST_F(AxisStateTest, WhatMovesNoOriginKeepsTheDatum) {
  Have(DatumRecord{.counts = 5});
  PendingCommand look = Command("look");
  ASSERT_TRUE(axes_.BeforeRoute(device_, look, now_));
  EXPECT_TRUE(Record().datum);
}

TEST_F(AxisStateTest, TheDatumIsInForceAgainIfTheOriginWasNotMoved) {
  for (const std::int8_t state : {S::STATE_REJECTED, S::STATE_EXPIRED, S::STATE_CANCELLED}) {
    Have(DatumRecord{.counts = 5, .who = "otto"});
    PendingCommand home = Command("home", state);
    home.operation = &kHome;
    ASSERT_TRUE(axes_.BeforeRoute(device_, home, now_));
    End(home);
    ASSERT_TRUE(Record().datum) << int{state};
    EXPECT_EQ(Record().datum->counts, 5);
    EXPECT_EQ(Record().datum->who, "otto");
    const std::size_t count = store_.Datums("axis1").size();
    End(home);
    EXPECT_EQ(store_.Datums("axis1").size(), count) << "a datum in force is not set again";
  }
  for (const std::int8_t state : {S::STATE_SUCCEEDED, S::STATE_FAILED, S::STATE_INDETERMINATE}) {
    Have(DatumRecord{.counts = 5});
    PendingCommand home = Command("home", state);
    home.operation = &kHome;
    ASSERT_TRUE(axes_.BeforeRoute(device_, home, now_));
    End(home);
    EXPECT_FALSE(Record().datum) << int{state};
  }
}

TEST_F(AxisStateTest, ADatumThatWasVoidBeforeStaysVoid) {
  PendingCommand home = Command("home", S::STATE_REJECTED);
  home.operation = &kHome;
  End(home);
  EXPECT_FALSE(Record().datum) << "there was none";
  Have(DatumRecord{.counts = 5});
  Have(DatumVoided{9, "home of another command"});
  End(home);
  EXPECT_FALSE(Record().datum);
  Have(DatumRecord{.counts = 6});
  ASSERT_TRUE(axes_.BeforeRoute(device_, home, now_));
  PendingCommand look = Command("look", S::STATE_REJECTED);
  End(look);
  EXPECT_FALSE(Record().datum) << "the outcome of another command";
}

TEST_F(AxisStateTest, ADatumThatWasGivenBackIsAnEvent) {
  PendingCommand restore = Command("set_datum");
  restore.purpose = PendingCommand::Purpose::kRestore;
  restore.status.text = "reads 3.2 m";
  restore.status.changes = {{"datum_counts", "", "1"}};
  End(restore);
  ASSERT_EQ(Kinds(), Names{"datum_restored"});
  EXPECT_EQ(events_[0].text, "its driver was given the datum back: reads 3.2 m");
  EXPECT_FALSE(Record().datum) << "it is no new datum";
  restore.status.state = S::STATE_FAILED;
  End(restore);
  PendingCommand mark = Command("mark_reference_lost");
  mark.purpose = PendingCommand::Purpose::kRestore;
  End(mark);
  EXPECT_EQ(Kinds().size(), 1U);
  EXPECT_FALSE(axes_.AnyExchanged());
  restore.status.reason_code = S::REASON_WRONG_IDENTITY;
  End(restore);
  EXPECT_TRUE(axes_.AnyExchanged()) << "its driver has seen another encoder";
}

// ---- another encoder is accepted ----

class AcceptExchangeTest : public AxisStateTest {
 protected:
  AcceptExchangeTest() {
    Have(IdentityChanged{"16"});
    Have(DatumRecord{.counts = 5});
    Have(WritesAdded{9, 1});
    Hello(At(9'000));
    events_.clear();
    store_.events.clear();
  }
  PendingCommand Accept(std::int8_t state, std::int32_t reason = S::REASON_NONE) {
    PendingCommand accept = Command("clear_datum", state);
    accept.status.operation = "accept_exchange";
    accept.status.reason_code = reason;
    End(accept);
    return accept;
  }
};

TEST_F(AcceptExchangeTest, WearAndDatumRestart) {
  const S status = Accept(S::STATE_SUCCEEDED).status;
  EXPECT_EQ(status.state, S::STATE_SUCCEEDED);
  EXPECT_EQ(status.verified, 1);
  EXPECT_EQ(status.text, "wear and datum restart: home the axis");
  ASSERT_EQ(status.n_changes, 1);
  EXPECT_EQ(status.changes[0].key, "identity");
  EXPECT_EQ(status.changes[0].after, "17");
  EXPECT_EQ(Record().identity, "17");
  EXPECT_EQ(Record().writes, 0);
  EXPECT_EQ(Record().since_utime, now_.utime);
  EXPECT_FALSE(Record().datum);
  EXPECT_FALSE(axes_.AnyExchanged());
  ASSERT_EQ(Kinds(), Names{"exchange_accepted"});
  EXPECT_EQ(events_[0].text, "by anna: wear and datum restart: home the axis");
}

TEST_F(AcceptExchangeTest, ADriverWithoutDatumOrWithOneOfTheFileIsNoObstacle) {
  S status = Accept(S::STATE_REJECTED, S::REASON_NO_DATUM).status;
  EXPECT_EQ(status.state, S::STATE_SUCCEEDED);
  EXPECT_EQ(status.reason_code, S::REASON_NONE);
  EXPECT_EQ(status.text, "wear and datum restart: home the axis");
  status = Accept(S::STATE_REJECTED, S::REASON_NOT_PERMITTED).status;
  EXPECT_EQ(status.state, S::STATE_SUCCEEDED);
  EXPECT_EQ(status.text, "wear restarts; the machine's file gives a datum of the old encoder: change it");
}

TEST_F(AcceptExchangeTest, AnotherOutcomeAcceptsNothing) {
  const S status = Accept(S::STATE_REJECTED, S::REASON_BUSY).status;
  EXPECT_EQ(status.state, S::STATE_REJECTED);
  EXPECT_TRUE(axes_.AnyExchanged());
  EXPECT_EQ(Record().identity, "16");
  EXPECT_TRUE(Kinds().empty());
}

TEST_F(AcceptExchangeTest, AJournalThatDoesNotTakeItFailsIt) {
  store_.fails = true;
  const S status = Accept(S::STATE_SUCCEEDED).status;
  EXPECT_EQ(status.state, S::STATE_FAILED);
  EXPECT_EQ(status.verified, 0);
  EXPECT_EQ(status.reason_code, S::REASON_JOURNAL);
  EXPECT_EQ(status.text, "the journal could not note it: see ALARM/bridge, then repeat it");
  EXPECT_TRUE(axes_.AnyExchanged());
  EXPECT_TRUE(Kinds().empty());
}

TEST_F(AcceptExchangeTest, EndsTheDoubtAboutThePlace) {
  HavePosition(0);
  Hello(At(6 * kTurn, "16"), kBoot + 1);
  ASSERT_TRUE(axes_.AnyDoubtful());
  Accept(S::STATE_SUCCEEDED);
  EXPECT_FALSE(axes_.AnyDoubtful());
}

// ---- what the bridge does in the place of its own operations ----

class SubstituteTest : public AxisStateTest {
 protected:
  Result<> Substitute(const std::string& operation) {
    pending_ = Command(operation);
    pending_.arguments = {{"note", "x"}};
    return axes_.Substitute(CountingFamily(), pending_);
  }
  PendingCommand pending_;
};

TEST_F(SubstituteTest, AnOperationOfTheDriverStaysAsItIs) {
  EXPECT_TRUE(Substitute("look"));
  EXPECT_EQ(pending_.operation->name, "look");
  EXPECT_EQ(ArgumentsOf(pending_.arguments), (Arguments{{"note", "x"}}));
}

TEST_F(SubstituteTest, AnAcceptedExchangeClearsTheDatum) {
  EXPECT_TRUE(Substitute("accept_exchange"));
  EXPECT_EQ(pending_.operation->name, "clear_datum");
  EXPECT_TRUE(pending_.arguments.empty());
}

TEST_F(SubstituteTest, TheDatumBeforeIsSetAgain) {
  Have(DatumRecord{.counts = 4, .utime = 40});
  Have(DatumRecord{.counts = 5, .utime = 50, .identity = "17"});
  Have(DatumRecord{.counts = 6, .utime = 60});
  EXPECT_TRUE(Substitute("undo_datum"));
  EXPECT_EQ(pending_.operation->name, "set_datum");
  EXPECT_EQ(ArgumentsOf(pending_.arguments), (Arguments{{"counts", "5"}, {"utime", "50"}, {"identity", "17"}}));
}

TEST_F(SubstituteTest, WithoutADatumThereIsNothingToUndo) {
  const auto refused = Substitute("undo_datum");
  ASSERT_FALSE(refused);
  EXPECT_EQ(refused.error().reason, S::REASON_NO_DATUM);
  EXPECT_EQ(refused.error().text,
            "no datum is in force: none was set, or the encoder's own origin was moved since; home the axis");
}

TEST_F(SubstituteTest, TheFirstDatumIsCleared) {
  Have(DatumRecord{.counts = 5});
  EXPECT_TRUE(Substitute("undo_datum"));
  EXPECT_EQ(pending_.operation->name, "clear_datum");
}

TEST_F(SubstituteTest, ADatumBeforeThatWasUndoneIsNotSetAgain) {
  Have(DatumRecord{.counts = 5});
  PendingCommand clear = Command("clear_datum");
  End(clear);
  Have(DatumRecord{.counts = 6});
  EXPECT_TRUE(Substitute("undo_datum"));
  EXPECT_EQ(pending_.operation->name, "clear_datum");
}

TEST_F(SubstituteTest, ADatumBeforeAMovedOriginIsRefused) {
  Have(DatumRecord{.counts = 5});
  Have(DatumVoided{9, "home 0a"});
  Have(DatumRecord{.counts = 6});
  const auto refused = Substitute("undo_datum");
  ASSERT_FALSE(refused);
  EXPECT_EQ(refused.error().reason, S::REASON_NO_DATUM);
  EXPECT_EQ(refused.error().text,
            "the encoder's own origin was moved after the datum before (home 0a): home the axis instead");
}

}  // namespace
}  // namespace axlecast
