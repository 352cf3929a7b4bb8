#include <gmock/gmock.h>

#include <axlecast/command_status_t.hpp>
#include <functional>
#include <variant>

#include "core/device/operation.h"
#include "drivers/tsubaki_sc/device_test_support.h"
#include "drivers/tsubaki_sc/operations.h"

namespace axlecast::tsubaki_sc {
namespace {

using Reason = command_status_t;
using testing::HasSubstr;

const ByteList kClear = {0x05, 0x00, 0x00, 0xFF, 0x00};
const ByteList kStop = {0x05, 0x00, 0x64, 0xFF, 0x00};
const ByteList kStart = {0x05, 0x00, 0xC8, 0xFF, 0x00};
constexpr const char* kStopKeys =
    "{address: 1, motor_control: stop, passwords: {old: {file: /p/old}}, password: old}";

bool IsWrite(const ByteList& request) { return request[1] == 0x05; }

// ---- clear_trip_count ----

TEST(ClearTripCount, IsVerifiedByTheCount) {
  DeviceFixture bench(kLoginKeys);
  bench.GoOnline();
  bench.unit.inputs[200] = 7;
  EXPECT_EQ(bench.Do("clear_trip_count").state, CommandState::kSucceeded) << bench.Last().text;
  EXPECT_TRUE(bench.Last().verified);
  ASSERT_EQ(bench.Last().changes.size(), 1U);
  EXPECT_EQ(bench.Last().changes[0].before, "7");
  EXPECT_EQ(bench.Last().changes[0].after, "0");
  EXPECT_EQ(bench.unit.clears, 1);
  EXPECT_EQ(bench.Do("clear_trip_count").state, CommandState::kSucceeded);
  EXPECT_EQ(bench.unit.clears, 1) << "it was 0 already";
  // The motor trips in between.
  bench.unit.inputs[200] = 7;
  bench.wire = [&](const ByteList& request) {
    const ByteList reply = bench.unit.Answer(request);
    if (IsWrite(request)) bench.unit.Trip(0x01, 1);
    return reply;
  };
  EXPECT_EQ(bench.Do("clear_trip_count").state, CommandState::kSucceeded);
  EXPECT_EQ(bench.Last().changes[0].after, "1");
}

TEST(ClearTripCount, IsWrittenOnceAndJudgedByReading) {
  for (const bool done : {true, false}) {
    DeviceFixture bench(kLoginKeys);
    bench.unit.logged_in = true;
    bench.GoOnline();
    bench.unit.inputs[200] = 7;
    bench.wire = [&](const ByteList& request) {
      if (!IsWrite(request)) return bench.unit.Answer(request);
      if (done) static_cast<void>(bench.unit.Answer(request));
      return ByteList();
    };
    EXPECT_EQ(bench.Do("clear_trip_count").state, done ? CommandState::kSucceeded : CommandState::kFailed);
    EXPECT_EQ(bench.Count(kClear), 1);
    EXPECT_EQ(bench.Last().reason, done ? 0 : Reason::REASON_READ_BACK_DIFFERS);
  }
}

TEST(ClearTripCount, IsIndeterminateWhenNothingCanBeReadAfterIt) {
  DeviceFixture bench(kLoginKeys);
  bench.unit.logged_in = true;
  bench.GoOnline();
  bench.unit.inputs[200] = 7;
  bool written = false;
  bench.wire = [&](const ByteList& request) {
    written = written || IsWrite(request);
    return written ? ByteList() : bench.unit.Answer(request);
  };
  EXPECT_EQ(bench.Do("clear_trip_count").state, CommandState::kIndeterminate);
  EXPECT_EQ(bench.Count(kClear), 1);
}

// ---- start_motor and stop_motor: who may ----

TEST(MotorOrders, AreRefusedUnlessTheConfigurationAllowsThem) {
  const struct {
    const char* keys;
    CommandState stop;
    CommandState start;
  } kCases[] = {{kLoginKeys, CommandState::kRejected, CommandState::kRejected},
                {kStopKeys, CommandState::kSucceeded, CommandState::kRejected},
                {kFullKeys, CommandState::kSucceeded, CommandState::kSucceeded}};
  for (const auto& c : kCases) {
    DeviceFixture bench(c.keys);
    bench.GoOnline();
    EXPECT_EQ(bench.Do("stop_motor").state, c.stop) << c.keys;
    EXPECT_EQ(bench.Do("start_motor").state, c.start) << c.keys;
    EXPECT_EQ(bench.unit.stops, c.stop == CommandState::kSucceeded ? 1 : 0);
    EXPECT_EQ(bench.unit.starts, c.start == CommandState::kSucceeded ? 1 : 0);
    if (c.start != CommandState::kRejected) continue;
    EXPECT_EQ(bench.Last().reason, Reason::REASON_NOT_PERMITTED);
    EXPECT_THAT(bench.Last().text, HasSubstr("motor_control"));
  }
}

// ---- start_motor ----

TEST(StartMotor, IsNotSentWhileTheMotorIsTripped) {
  DeviceFixture bench(kFullKeys);
  bench.GoOnline();
  bench.unit.Trip(0x20, 1);
  EXPECT_EQ(bench.Do("start_motor").state, CommandState::kRejected);
  EXPECT_EQ(bench.Last().reason, Reason::REASON_DEVICE_ALARM);
  EXPECT_THAT(bench.Last().text, HasSubstr("overheat"));
  EXPECT_EQ(bench.Count(kStart), 0);
  // From now on it is known, and reported at once.
  DriverCommand order;
  order.operation = "start_motor";
  const Result<> valid = bench.device->Validate(order, bench.now);
  ASSERT_FALSE(valid);
  EXPECT_EQ(RefusedOutcome(valid.error()).text, bench.Last().text);
}

TEST(StartMotor, IsVerifiedByTheStopCoilIfThatWasOn) {
  DeviceFixture bench(kFullKeys);
  bench.unit.stop_coil = true;
  bench.GoOnline();
  EXPECT_EQ(bench.Do("start_motor").state, CommandState::kSucceeded);
  EXPECT_TRUE(bench.Last().verified);
  EXPECT_EQ(bench.Do("start_motor").state, CommandState::kSucceeded);
  EXPECT_FALSE(bench.Last().verified) << "running is not to be read anywhere";
}

TEST(StartMotor, IsSentOnceAndIndeterminateWhenNothingTellsItsEffect) {
  DeviceFixture bench(kFullKeys);
  bench.GoOnline();
  bench.RunUntil([&] { return bench.unit.logged_in; });
  bench.wire = [&](const ByteList& request) { return IsWrite(request) ? ByteList() : bench.unit.Answer(request); };
  EXPECT_EQ(bench.Do("start_motor").state, CommandState::kIndeterminate);
  EXPECT_EQ(bench.Count(kStart), 1);
  // With the stop coil on, the coil shows the effect.
  bench.unit.stop_coil = true;
  EXPECT_EQ(bench.Do("start_motor").state, CommandState::kFailed);
  EXPECT_EQ(bench.Last().reason, Reason::REASON_READ_BACK_DIFFERS);
  EXPECT_EQ(bench.Count(kStart), 2);
}

// ---- stop_motor ----

TEST(StopMotor, GoesOutNextAndBeforeAnOrderThatIsUnderWay) {
  DeviceFixture bench(kFullKeys);
  bench.GoOnline();
  bench.RunUntil([&] { return bench.unit.logged_in; });
  bench.Begin("read_parameters");
  bench.Turns(1);
  bench.sent.clear();
  bench.Begin("stop_motor");
  bench.Turns(1);
  EXPECT_EQ(bench.sent[0].request, WithCrc({1, 0x05, 0x00, 0x64, 0xFF, 0x00}));
  EXPECT_EQ(bench.sent[0].priority, Priority::kStop);
  bench.RunUntil([&] { return bench.Finals() == 2; });
  EXPECT_EQ(bench.output.outcomes.front().second.state, CommandState::kSucceeded);
  EXPECT_TRUE(bench.output.outcomes.front().second.verified);
  EXPECT_TRUE(bench.unit.stop_coil);
  EXPECT_EQ(bench.Last().state, CommandState::kSucceeded) << "the parameters are read all the same";
}

TEST(StopMotor, DoesNotWaitForTheFence) {
  DeviceFixture bench(kFullKeys);
  bench.GoOnline();
  bench.RunUntil([&] { return bench.unit.logged_in; });
  const auto answer = bench.wire;
  bench.wire = [](const ByteList&) { return ByteList(); };
  bench.BusSlot();
  bench.wire = answer;
  bench.sent.clear();
  bench.Begin("stop_motor");
  bench.Turns(1);
  ASSERT_FALSE(bench.sent.empty());
  EXPECT_EQ(bench.Count(kStop), 1);
  bench.RunUntil([&] { return bench.Last().IsFinal(); });
  EXPECT_EQ(bench.Last().state, CommandState::kSucceeded) << bench.Last().text;
  EXPECT_GE(bench.Count({0x02}), 1) << "its reading back does";
}

TEST(StopMotor, IsSentAgainUntilTheCoilReadsOn) {
  DeviceFixture bench(kFullKeys);
  bench.GoOnline();
  bench.RunUntil([&] { return bench.unit.logged_in; });
  int lost = 0;
  bench.wire = [&](const ByteList& request) {
    if (IsWrite(request) && lost < 2) {
      ++lost;
      return ByteList();
    }
    return bench.unit.Answer(request);
  };
  EXPECT_EQ(bench.Do("stop_motor").state, CommandState::kSucceeded) << bench.Last().text;
  EXPECT_EQ(bench.Count(kStop), 3);
  EXPECT_EQ(bench.unit.stops, 1);
}

TEST(StopMotor, SaysSoWhenTheUnitDoesNotTakeIt) {
  DeviceFixture bench(kFullKeys);
  bench.GoOnline();
  bench.wire = [&](const ByteList& request) {
    return IsWrite(request) ? WithCrc(request[0] == 1 ? ByteList{1, 0x85, 0x02} : ByteList())
                            : bench.unit.Answer(request);
  };
  EXPECT_EQ(bench.Do("stop_motor").state, CommandState::kFailed);
  EXPECT_THAT(bench.Last().text, HasSubstr("stop the motor by other means"));
  bench.wire = [](const ByteList&) { return ByteList(); };
  EXPECT_EQ(bench.Do("stop_motor").state, CommandState::kIndeterminate) << "it may have arrived";
  EXPECT_THAT(bench.Last().text, HasSubstr("stop the motor by other means"));
}

// Bytes of somebody else, one each 5 ms without end, until `done`.
void RunOnABusyLine(DeviceFixture& bench, const std::function<bool()>& done) {
  for (int i = 0; i < 10'000 && !done(); ++i) {
    bench.Stray({0x55});
    if (std::holds_alternative<Exchange>(bench.Peek().action))
      bench.BusSlot();
    else
      bench.now += 5 * kMillisecond;
  }
  EXPECT_TRUE(done());
}

TEST(StopMotor, GoesOutOnALineThatIsNeverIdle) {
  DeviceFixture bench(kFullKeys);
  bench.GoOnline();
  bench.RunUntil([&] { return bench.unit.logged_in; });
  bench.sent.clear();
  const MonoNs quiet = bench.now + kSecond;
  RunOnABusyLine(bench, [&] { return bench.now >= quiet; });
  EXPECT_TRUE(bench.sent.empty()) << "nothing else is transmitted";
  bench.Begin("stop_motor");
  const MonoNs asked = bench.now;
  RunOnABusyLine(bench, [&] { return !bench.sent.empty(); });
  EXPECT_EQ(bench.Count(kStop), 1);
  EXPECT_LE(bench.sent[0].at - asked, 25 * kMillisecond);
  EXPECT_TRUE(bench.unit.stop_coil);
  RunOnABusyLine(bench, [&] { return bench.Last().IsFinal(); });
  EXPECT_EQ(bench.Last().state, CommandState::kSucceeded) << bench.Last().text << ": replies come through";
  EXPECT_TRUE(bench.Last().verified);
}

TEST(StopMotor, WaitsForASilentLineNoLongerThan25Milliseconds) {
  DeviceFixture bench(kFullKeys);
  bench.GoOnline();
  bench.RunUntil([&] { return bench.unit.logged_in; });
  bench.Stray({0x55});
  bench.Begin("stop_motor");
  ASSERT_TRUE(std::holds_alternative<WaitForIdleLine>(bench.Peek().action)) << "bytes may end soon";
  bench.now += 20 * kMillisecond;
  bench.Stray({0x55});
  ASSERT_TRUE(std::holds_alternative<WaitForIdleLine>(bench.Peek().action));
  bench.now += 5 * kMillisecond;
  const Step step = bench.Peek();
  ASSERT_TRUE(std::holds_alternative<Exchange>(step.action));
  EXPECT_TRUE(std::get<Exchange>(step.action).regardless);
}

TEST(StopMotor, IsRepeatedFor5SecondsAndIndeterminateWhenNothingCanBeRead) {
  DeviceFixture bench(kFullKeys);
  bench.GoOnline();
  bench.RunUntil([&] { return bench.unit.logged_in; });
  bench.sent.clear();
  bool garbled = true;
  bench.wire = [&](const ByteList& request) {
    const ByteList reply = bench.unit.Answer(request);
    return garbled ? ByteList{0x55, 0x55, 0x55, 0x55, 0x55, 0x55, 0x55, 0x55} : reply;
  };
  const MonoNs begun = bench.now;
  bench.Begin("stop_motor");
  RunOnABusyLine(bench, [&] { return bench.Last().IsFinal(); });
  EXPECT_EQ(bench.Last().state, CommandState::kIndeterminate);
  EXPECT_THAT(bench.Last().text, HasSubstr("bytes came that are no answer"));
  EXPECT_THAT(bench.Last().text, HasSubstr("stop the motor by other means"));
  EXPECT_FALSE(bench.Last().verified);
  EXPECT_GE(bench.now - begun, 5 * kSecond);
  EXPECT_LE(bench.now - begun, 7 * kSecond);
  EXPECT_GE(bench.Count(kStop), 10);
  // When the line becomes readable meanwhile, it is verified.
  bench.Begin("stop_motor");
  bench.sent.clear();
  RunOnABusyLine(bench, [&] { return bench.Count(kStop) >= 5; });
  garbled = false;
  RunOnABusyLine(bench, [&] { return bench.Finals() == 2; });
  EXPECT_EQ(bench.Last().state, CommandState::kSucceeded) << bench.Last().text;
}

TEST(StopMotor, IsRepeatedWhileTheCoilReadsOffAndThenFails) {
  DeviceFixture bench(kFullKeys);
  bench.GoOnline();
  bench.RunUntil([&] { return bench.unit.logged_in; });
  bench.wire = [&](const ByteList& request) {
    const ByteList reply = bench.unit.Answer(request);
    bench.unit.stop_coil = false;
    return reply;
  };
  EXPECT_EQ(bench.Do("stop_motor").state, CommandState::kFailed);
  EXPECT_EQ(bench.Last().reason, Reason::REASON_READ_BACK_DIFFERS);
  EXPECT_GT(bench.Count(kStop), 3);
}

TEST(StopMotor, LogsInFirstOnlyWhenItMust) {
  DeviceFixture bench(kStopKeys);
  bench.GoOnline();
  bench.RunUntil([&] { return bench.unit.logged_in; });
  bench.unit.PowerCycle();
  bench.sent.clear();
  EXPECT_EQ(bench.Do("stop_motor").state, CommandState::kSucceeded) << bench.Last().text;
  EXPECT_EQ(bench.Count(kStop), 2);
  EXPECT_EQ(bench.unit.stops, 1);
  for (const DeviceFixture::Sent& one : bench.sent)
    EXPECT_EQ(one.priority, Priority::kStop) << "nothing came between";
}

TEST(StopMotor, IsTriedOnAUnitThatSeemsToBeGone) {
  DeviceFixture bench(kFullKeys);
  bench.GoOnline();
  const auto answer = bench.wire;
  bench.wire = [](const ByteList&) { return ByteList(); };
  bench.Turns(10);
  EXPECT_EQ(bench.Do("read_parameters").reason, Reason::REASON_DEVICE_OFFLINE);
  bench.wire = answer;
  EXPECT_EQ(bench.Do("stop_motor").state, CommandState::kSucceeded) << bench.Last().text;
}

}  // namespace
}  // namespace axlecast::tsubaki_sc
