#include "drivers/tsubaki_sc/procedure.h"

#include <gmock/gmock.h>
#include <axlecast/command_status_t.hpp>

#include "drivers/tsubaki_sc/device_test_support.h"

namespace axlecast::tsubaki_sc {
namespace {

using Reason = command_status_t;

TEST(CommandSlot, HoldsOneOrderAndAnUrgentOne) {
  DeviceFixture bench(kFullKeys);
  bench.GoOnline();
  bench.RunUntil([&] { return bench.unit.logged_in; });
  bench.Begin("read_parameters");
  bench.Begin("read_state");
  EXPECT_EQ(bench.Last().reason, Reason::REASON_BUSY);
  bench.Begin("stop_motor");
  bench.Begin("stop_motor");
  EXPECT_EQ(bench.Last().reason, Reason::REASON_BUSY);
  bench.RunUntil([&] { return bench.Finals() == 4; });
  EXPECT_EQ(bench.Last().state, CommandState::kSucceeded);
}

TEST(CommandSlot, AnOrderWhoseTimeToBeginIsOverDoesNothing) {
  DeviceFixture bench(kLoginKeys);
  bench.GoOnline();
  bench.unit.inputs[200] = 3;
  bench.Begin("clear_trip_count", {}, bench.now - 1);
  EXPECT_EQ(bench.Last().state, CommandState::kExpired);
  // Held by the fence, to a unit that is gone meanwhile.
  bench.Begin("clear_trip_count", {}, bench.now + 100 * kMillisecond);
  bench.now += 200 * kMillisecond;
  bench.sent.clear();
  bench.Turns(2);
  EXPECT_EQ(bench.Last().state, CommandState::kExpired);
  EXPECT_EQ(bench.Finals(), 2U);
  EXPECT_EQ(bench.Count({0x05}), 0);
}

TEST(CommandSlot, CanBeCancelledUntilItHasTouchedTheUnit) {
  DeviceFixture bench(kLoginKeys);
  bench.unit.logged_in = true;
  bench.GoOnline();
  bench.unit.inputs[200] = 3;
  bench.Begin("clear_trip_count");
  EXPECT_FALSE(bench.device->Cancel({0xEE}, bench.now)) << "another one";
  bench.Turns(1);  // it only looks
  EXPECT_TRUE(bench.device->Cancel(bench.last_id, bench.now));
  EXPECT_FALSE(bench.device->Cancel(bench.last_id, bench.now)) << "gone";
  bench.Turns(5);
  EXPECT_EQ(bench.Count({0x05}), 0);
  bench.Begin("clear_trip_count");
  bench.RunUntil([&] { return bench.Count({0x05}) == 1; });
  EXPECT_FALSE(bench.device->Cancel(bench.last_id, bench.now));
  bench.RunUntil([&] { return bench.Last().IsFinal(); });
  EXPECT_EQ(bench.Last().state, CommandState::kSucceeded);
}

TEST(CommandSlot, EndsWithTheLink) {
  const struct {
    const char* operation;
    int writes_before;
    CommandState state;
  } kCases[] = {{"read_parameters", 0, CommandState::kFailed},
                {"clear_trip_count", 0, CommandState::kFailed},
                {"clear_trip_count", 1, CommandState::kIndeterminate},
                {"stop_motor", 0, CommandState::kFailed},
                {"stop_motor", 1, CommandState::kIndeterminate}};
  for (const auto& c : kCases) {
    SCOPED_TRACE(c.operation);
    DeviceFixture bench(kFullKeys);
    bench.unit.logged_in = true;
    bench.GoOnline();
    bench.unit.inputs[200] = 3;
    bench.Begin(c.operation);
    bench.RunUntil([&] { return bench.Count({0x05}) == c.writes_before; });
    bench.LinkDown();
    EXPECT_EQ(bench.Last().state, c.state) << bench.Last().text;
    bench.Begin("read_state");
    EXPECT_EQ(bench.Last().reason, Reason::REASON_DEVICE_OFFLINE);
  }
}

// ---- set_password and check_password ----

TEST(SetPassword, IsReadBackAndUsedFromThenOn) {
  DeviceFixture bench(kLoginKeys);
  bench.GoOnline();
  EXPECT_EQ(bench.Do("set_password", {{"name", "new"}}).state, CommandState::kSucceeded) << bench.Last().text;
  EXPECT_TRUE(bench.Last().verified);
  EXPECT_EQ(bench.unit.password, "New-Secret~16chr");
  EXPECT_EQ(bench.output.nv_writes, 1);
  bench.unit.PowerCycle();
  EXPECT_EQ(bench.Do("log_in").state, CommandState::kSucceeded) << bench.Last().text;
  EXPECT_EQ(bench.Do("check_password", {{"name", "new"}}).changes[0].after, "reads_as_after");
  EXPECT_EQ(bench.Do("check_password", {{"after", "set_password name=old"}}).changes[0].after, "no_effect_seen");
}

TEST(SetPassword, IsRefusedForANameThatIsNotThereOrHoldsNone) {
  DeviceFixture bench(kLoginKeys);
  bench.GoOnline();
  EXPECT_EQ(bench.Do("set_password", {{"name", "New-Secret~16chr"}}).reason, Reason::REASON_BAD_ARGUMENT);
  EXPECT_THAT(bench.Last().text, testing::Not(testing::HasSubstr("Secret")));
  EXPECT_EQ(bench.Do("check_password", {}).reason, Reason::REASON_BAD_ARGUMENT);
  EXPECT_EQ(bench.Do("check_password", {{"after", "log_in"}}).reason, Reason::REASON_BAD_ARGUMENT);
  bench.secrets.files["/p/new"] = "too short";
  EXPECT_EQ(bench.Do("set_password", {{"name", "new"}}).state, CommandState::kRejected);
  EXPECT_EQ(bench.Count({0x10}), 0);
}

TEST(SetPassword, IsWrittenOnceAndIndeterminateWhenItCannotBeReadBack) {
  DeviceFixture bench(kLoginKeys);
  bench.unit.logged_in = true;
  bench.GoOnline();
  bench.wire = [&](const ByteList& request) {
    const unsigned at = TestUnit::Word(request, 2);
    return at == 200 && request[1] != 0x04 ? ByteList() : bench.unit.Answer(request);
  };
  EXPECT_EQ(bench.Do("set_password", {{"name", "new"}}).state, CommandState::kIndeterminate);
  EXPECT_EQ(bench.Count({0x10, 0x00, 0xC8}), 1);
}

TEST(CheckPassword, DoesNotLogIn) {
  DeviceFixture bench(kLoginKeys);
  bench.GoOnline();
  EXPECT_EQ(bench.Do("check_password", {{"name", "old"}}).state, CommandState::kRejected);
  EXPECT_THAT(bench.Last().text, testing::HasSubstr("log_in first"));
  EXPECT_EQ(bench.unit.login_writes, 0);
}

// ---- what only reads ----

TEST(Readout, ShowsStateSetValuesAndIdentity) {
  DeviceFixture bench;
  bench.unit.stop_coil = true;
  bench.unit.Trip(0x20, 1);
  bench.GoOnline();
  EXPECT_EQ(bench.Do("read_state").text,
            "trip count 1, motor status 0x20 overheat, stop coil 1, logged out, mains 50 Hz");
  EXPECT_EQ(bench.Do("read_set_values").changes[0].after,
            "upper_a 100.0, upper_b 100.1, lower_a 100.2, lower_b 100.3 W");
  EXPECT_EQ(bench.Last().changes[1].after, "100.4 s");
  EXPECT_EQ(bench.Last().changes[2].after, "upper_a 100.5, upper_b 100.6, lower_a 100.7, lower_b 100.8 s");
  EXPECT_EQ(bench.Do("read_identity").text, "product code SC02, MFG number T123456789, version 1.0.0");
}

TEST(Readout, SaysWhetherAnOperationTookEffect) {
  DeviceFixture bench;
  bench.GoOnline();
  const auto finding = [&](const char* after) {
    const Outcome& outcome = bench.Do("read_state", {{"after", after}});
    return outcome.changes.empty() ? "" : outcome.changes.back().after;
  };
  EXPECT_EQ(finding("stop_motor"), "cannot_tell");
  EXPECT_EQ(finding("start_motor"), "reads_as_after");
  EXPECT_EQ(finding("clear_trip_count"), "reads_as_after");
  bench.unit.stop_coil = true;
  bench.unit.inputs[200] = 4;
  EXPECT_EQ(finding("stop_motor"), "reads_as_after");
  EXPECT_EQ(finding("start_motor"), "cannot_tell");
  EXPECT_EQ(finding("clear_trip_count"), "cannot_tell");
  EXPECT_EQ(finding("log_in"), "");
}

}  // namespace

}  // namespace axlecast::tsubaki_sc
