#include <gmock/gmock.h>

#include <axlecast/command_status_t.hpp>
#include <random>

#include "drivers/tsubaki_sc/device_test_support.h"
#include "drivers/tsubaki_sc/operations.h"

// The way out of a login: the password is written again (guideline 11; 6, note 1), which switches the state. So it is
// written only when AI 300 was just read as logged in.
namespace axlecast::tsubaki_sc {
namespace {

using Reason = command_status_t;
using testing::EndsWith;
using testing::HasSubstr;

bool IsLoginWrite(const ByteList& request) { return request[1] == 0x10 && TestUnit::Word(request, 2) == 100; }
bool IsLoginRead(const ByteList& request) { return request[1] == 0x04 && TestUnit::Word(request, 2) == 300; }

// A unit that checks what guideline 6, note 1 asks of its master.
class SwitchedUnit {
 public:
  explicit SwitchedUnit(DeviceFixture& bench) : bench_(bench) {}

  // Requests and replies may be lost.
  ByteList Answer(const ByteList& request, bool request_lost, bool reply_lost) {
    const bool was = bench_.unit.logged_in;
    if (IsLoginWrite(request) && !request_lost) {
      EXPECT_TRUE(read_) << "the password was written without a reading of the state before";
      EXPECT_EQ(said_, was) << "the password was written in another state than that which was read";
    }
    const ByteList reply = request_lost ? ByteList() : bench_.unit.Answer(request);
    const bool answered = !request_lost && !reply_lost;
    // A reading counts until anything fails.
    read_ = answered && (IsLoginRead(request) || (read_ && !IsLoginWrite(request)));
    said_ = IsLoginRead(request) ? bench_.unit.logged_in : said_;
    return answered ? reply : ByteList();
  }

 private:
  DeviceFixture& bench_;
  bool read_ = false;
  bool said_ = false;
};

TEST(LogOut, FollowsEveryOrderThatLoggedIn) {
  const struct {
    const char* operation;
    Arguments arguments;
    int writes;  // of the password, in and out
  } kCases[] = {{"clear_trip_count", {}, 2},
                {"write_parameter", {{"name", "start_time_1"}, {"value", "3.0"}}, 2},
                {"set_password", {{"name", "new"}}, 2},
                {"read_parameters", {}, 0}};
  for (const auto& c : kCases) {
    SCOPED_TRACE(c.operation);
    DeviceFixture bench(kLoginKeys);
    SwitchedUnit unit(bench);
    bench.wire = [&](const ByteList& request) { return unit.Answer(request, false, false); };
    bench.GoOnline();
    bench.unit.inputs[200] = 5;
    EXPECT_EQ(bench.Do(c.operation, c.arguments).state, CommandState::kSucceeded) << bench.Last().text;
    EXPECT_EQ(bench.unit.login_writes, c.writes);
    EXPECT_FALSE(bench.unit.logged_in);
    if (c.writes == 0) continue;
    EXPECT_THAT(bench.Last().text, EndsWith("; logged out again"));
    EXPECT_TRUE(IsLoginRead(bench.sent.back().request)) << "it is verified";
    bench.RunUntil([&] { return !bench.output.motors.empty() && bench.output.motors.back().logged_in == 0; }, 60);
  }
}

TEST(LogOut, FollowsAnOrderThatFailed) {
  DeviceFixture bench(kLoginKeys);
  bench.GoOnline();
  bench.unit.inputs[200] = 5;
  bench.wire = [&](const ByteList& request) {
    return request[1] == 0x05 ? WithCrc({1, 0x85, 0x04}) : bench.unit.Answer(request);
  };
  EXPECT_EQ(bench.Do("clear_trip_count").state, CommandState::kFailed);
  EXPECT_THAT(bench.Last().text, EndsWith("; logged out again"));
  EXPECT_FALSE(bench.unit.logged_in);
}

TEST(LogOut, LeavesAUnitAloneThatWasLoggedInBefore) {
  DeviceFixture bench(kLoginKeys);
  bench.unit.logged_in = true;
  bench.GoOnline();
  bench.unit.inputs[200] = 5;
  EXPECT_EQ(bench.Do("clear_trip_count").state, CommandState::kSucceeded);
  bench.Turns(300);
  EXPECT_EQ(bench.unit.login_writes, 0);
  EXPECT_TRUE(bench.unit.logged_in);
}

TEST(LogOut, IsSwitchedOffByTheConfiguration) {
  DeviceFixture bench(kKeptKeys);
  bench.GoOnline();
  bench.unit.inputs[200] = 5;
  EXPECT_EQ(bench.Do("clear_trip_count").state, CommandState::kSucceeded);
  bench.Turns(300);
  EXPECT_EQ(bench.unit.login_writes, 1);
  EXPECT_TRUE(bench.unit.logged_in);
}

TEST(LogOut, IsDoneOnOrderAndKeepsWhatLogInAskedFor) {
  DeviceFixture bench(kLoginKeys);
  bench.GoOnline();
  EXPECT_EQ(bench.Do("log_in").state, CommandState::kSucceeded);
  bench.unit.inputs[200] = 5;
  EXPECT_EQ(bench.Do("clear_trip_count").state, CommandState::kSucceeded);
  bench.Turns(300);
  EXPECT_TRUE(bench.unit.logged_in) << "log_in lasts";
  EXPECT_EQ(bench.Do("log_out").state, CommandState::kSucceeded) << bench.Last().text;
  EXPECT_TRUE(bench.Last().verified);
  EXPECT_FALSE(bench.unit.logged_in);
  EXPECT_EQ(bench.unit.login_writes, 2);
  EXPECT_EQ(bench.Do("log_out").state, CommandState::kSucceeded) << "it is logged out already";
  EXPECT_EQ(bench.unit.login_writes, 2);
  // From now on orders log out again.
  bench.unit.inputs[200] = 5;
  EXPECT_EQ(bench.Do("clear_trip_count").state, CommandState::kSucceeded);
  EXPECT_FALSE(bench.unit.logged_in);
}

TEST(LogOut, IsRefusedWhereMotorControlKeepsTheUnitLoggedIn) {
  DeviceFixture bench(kFullKeys);
  bench.GoOnline();
  EXPECT_EQ(bench.Do("log_out").reason, Reason::REASON_NOT_PERMITTED);
  EXPECT_THAT(bench.Last().text, HasSubstr("log_out: true"));
  DeviceFixture plain;
  plain.GoOnline();
  EXPECT_EQ(plain.Do("log_out").reason, Reason::REASON_NOT_PERMITTED);
}

// With motor_control the key makes a stop log in first, and the unit does not stay logged in.
TEST(LogOut, FollowsAStopWhoseOutcomeDoesNotWaitForIt) {
  DeviceFixture bench(
      "{address: 1, motor_control: stop, log_out: true, passwords: {old: {file: /p/old}}, password: old}");
  bench.GoOnline();
  bench.Turns(300);
  EXPECT_EQ(bench.unit.login_writes, 0) << "nothing needs a login yet";
  EXPECT_EQ(bench.Do("stop_motor").state, CommandState::kSucceeded);
  EXPECT_TRUE(bench.unit.logged_in);
  bench.RunUntil([&] { return !bench.unit.logged_in; }, 20);
  bench.Turns(300);
  EXPECT_EQ(bench.unit.login_writes, 2);
  EXPECT_FALSE(bench.unit.logged_in);
}

TEST(LogOut, ThatFailsIsToldAndRaisesAnAlarm) {
  DeviceFixture bench(kLoginKeys);
  bench.GoOnline();
  bench.unit.inputs[200] = 5;
  bool out = false;
  bench.wire = [&](const ByteList& request) {
    out = out || bench.unit.logged_in;
    if (out && IsLoginWrite(request)) return WithCrc({1, 0x90, 0x03});
    return bench.unit.Answer(request);
  };
  EXPECT_EQ(bench.Do("clear_trip_count").state, CommandState::kSucceeded) << "what it was for is done";
  EXPECT_THAT(bench.Last().text, HasSubstr("; still logged in: the unit did not take the password"));
  EXPECT_EQ(bench.output.State("still_logged_in"), AlarmState::kLive);
  // It is tried again when the state is read again, and not without end.
  bench.wire = [&](const ByteList& request) { return bench.unit.Answer(request); };
  bench.RunUntil([&] { return !bench.unit.logged_in; });
  bench.Turns(10);
  EXPECT_EQ(bench.output.State("still_logged_in"), AlarmState::kAbsent);
}

TEST(LogOut, ALostReplyIsClearedUpByReadingTheState) {
  for (const bool arrived : {true, false}) {
    SCOPED_TRACE(arrived);
    DeviceFixture bench(kLoginKeys);
    SwitchedUnit unit(bench);
    bool lost = false;
    bench.wire = [&](const ByteList& request) {
      const bool lose = !lost && bench.unit.logged_in && IsLoginWrite(request);
      lost = lost || lose;
      return unit.Answer(request, lose && !arrived, lose);
    };
    bench.GoOnline();
    bench.unit.inputs[200] = 5;
    EXPECT_EQ(bench.Do("clear_trip_count").state, CommandState::kSucceeded);
    EXPECT_THAT(bench.Last().text, EndsWith("; logged out again"));
    EXPECT_TRUE(lost);
    EXPECT_EQ(bench.unit.login_writes, 2);
    EXPECT_FALSE(bench.unit.logged_in);
  }
}

// Whatever is lost, the password is never written blindly, and the unit ends logged out.
TEST(LogOut, NeverSwitchesAStateThatItHasNotRead) {
  for (unsigned seed = 0; seed < 300; ++seed) {
    SCOPED_TRACE(seed);
    std::mt19937 random(seed);
    const auto chance = [&](unsigned percent) { return random() % 100 < percent; };
    DeviceFixture bench(kLoginKeys);
    SwitchedUnit unit(bench);
    const auto loss = static_cast<unsigned>(random() % 40);
    bool losing = false;
    int off = 0;  // requests that fall into the time that the unit is off, or starts
    bench.wire = [&](const ByteList& request) {
      if (losing && chance(1)) {
        bench.unit.PowerCycle();
        off = 2;
      }
      if (off > 0) return unit.Answer(request, off-- > 0, true);
      const bool lost = losing && chance(loss);
      return unit.Answer(request, lost && chance(50), lost);
    };
    bench.GoOnline();
    for (int order = 0; order < 5; ++order) {
      losing = true;
      bench.unit.inputs[200] = 5;
      const std::size_t before = bench.Finals();
      bench.Begin(chance(20) ? "log_out" : "clear_trip_count");
      bench.RunUntil([&] { return bench.Finals() > before; });
      losing = false;
      bench.RunUntil([&] { return !bench.unit.logged_in; });
    }
  }
}

TEST(SetPassword, ThatIsInDoubtLeavesTheUnitLoggedIn) {
  DeviceFixture bench(kLoginKeys);
  bench.GoOnline();
  bench.wire = [&](const ByteList& request) {
    const ByteList reply = bench.unit.Answer(request);
    return TestUnit::Word(request, 2) == 200 && request[1] != 0x04 ? ByteList() : reply;
  };
  // The unit refuses it while logged out: that reply must come.
  const auto lossy = bench.wire;
  bench.wire = [&](const ByteList& request) {
    return bench.unit.logged_in ? lossy(request) : bench.unit.Answer(request);
  };
  EXPECT_EQ(bench.Do("set_password", {{"name", "new"}}).state, CommandState::kIndeterminate);
  EXPECT_THAT(bench.Last().text, HasSubstr("check_password, then log_out"));
  bench.wire = [&](const ByteList& request) { return bench.unit.Answer(request); };
  bench.Turns(300);
  EXPECT_TRUE(bench.unit.logged_in) << "which password would log it out is not known";
  EXPECT_EQ(bench.unit.login_writes, 1);
  EXPECT_EQ(bench.Do("check_password", {{"after", "set_password name=new"}}).changes[0].after, "reads_as_after");
  EXPECT_EQ(bench.Do("log_out").state, CommandState::kSucceeded) << "the password that it has is known now";
  EXPECT_FALSE(bench.unit.logged_in);
}

// The login state that was read before is outdated.
TEST(CheckPassword, ReadsTheLoginStateItself) {
  DeviceFixture bench(kLoginKeys);
  bench.GoOnline();
  ASSERT_EQ(bench.Do("set_password", {{"name", "new"}}).state, CommandState::kSucceeded);
  bench.unit.logged_in = true;  // by somebody else, unseen
  EXPECT_EQ(bench.Do("check_password", {{"name", "new"}}).state, CommandState::kSucceeded) << bench.Last().text;
  bench.unit.logged_in = false;
  EXPECT_EQ(bench.Do("check_password", {{"name", "new"}}).state, CommandState::kRejected);
  EXPECT_THAT(bench.Last().text, HasSubstr("log_in first"));
}

}  // namespace
}  // namespace axlecast::tsubaki_sc
