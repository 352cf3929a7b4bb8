#include <gmock/gmock.h>
#include <axlecast/command_status_t.hpp>

#include "drivers/tsubaki_sc/device_test_support.h"

namespace axlecast::tsubaki_sc {
namespace {

using Reason = command_status_t;
using testing::HasSubstr;

const ByteList kReadLogin = {0x04, 0x01, 0x2C, 0x00, 0x01};
const ByteList kWriteLogin = {0x10, 0x00, 0x64};

// Returns the index in bench.sent of the first request that begins so.
std::ptrdiff_t IndexOf(const DeviceFixture& bench, const ByteList& begin) {
  const auto found = std::find_if(bench.sent.begin(), bench.sent.end(), [&](const DeviceFixture::Sent& one) {
    return std::equal(begin.begin(), begin.end(), one.request.begin() + 1);
  });
  return found - bench.sent.begin();
}

TEST(Login, LooksWritesThePasswordAndLooksAgain) {
  DeviceFixture bench(kLoginKeys);
  bench.GoOnline();
  EXPECT_EQ(bench.unit.login_writes, 0) << "no command needs it";
  EXPECT_EQ(bench.Do("log_in").state, CommandState::kSucceeded) << bench.Last().text;
  EXPECT_TRUE(bench.Last().verified);
  EXPECT_TRUE(bench.unit.logged_in);
  EXPECT_EQ(bench.unit.login_writes, 1);
  EXPECT_LT(IndexOf(bench, kReadLogin), IndexOf(bench, kWriteLogin));
  EXPECT_EQ(bench.Count(kReadLogin), 2);
  bench.Turns(2);
  EXPECT_EQ(bench.output.motors.back().logged_in, 1);
}

// Writing it changes the state: a unit that is logged in would be logged out (guideline 6, note 1).
TEST(Login, IsNotWrittenToAUnitThatSaysLoggedIn) {
  DeviceFixture bench(kLoginKeys);
  bench.unit.logged_in = true;
  bench.GoOnline();
  EXPECT_EQ(bench.Do("log_in").state, CommandState::kSucceeded);
  EXPECT_EQ(bench.unit.login_writes, 0);
  EXPECT_TRUE(bench.unit.logged_in);
}

TEST(Login, AWrongPasswordIsWrittenOnceAndNeverAgain) {
  DeviceFixture bench(kLoginKeys);
  bench.unit.password = "something-else";
  bench.GoOnline();
  // Nothing to clear; the login that the write needs fails; from then on it is known.
  for (const CommandState state : {CommandState::kSucceeded, CommandState::kFailed, CommandState::kRejected}) {
    EXPECT_EQ(bench.Do("clear_trip_count").state, state);
    bench.unit.inputs[200] = 5;
  }
  EXPECT_EQ(bench.Last().reason, Reason::REASON_DEVICE_REFUSED);
  EXPECT_THAT(bench.Last().text, HasSubstr("refused password old"));
  EXPECT_EQ(bench.unit.login_writes, 1);
  EXPECT_EQ(bench.output.State("wrong_password"), AlarmState::kDriverLatched);
  // Corrected: log_in tries again, and the alarm goes.
  bench.secrets.files["/p/old"] = "something-else";
  EXPECT_EQ(bench.Do("log_in").state, CommandState::kSucceeded) << bench.Last().text;
  EXPECT_EQ(bench.unit.login_writes, 2);
  EXPECT_EQ(bench.output.State("wrong_password"), AlarmState::kAbsent);
  EXPECT_EQ(bench.Do("clear_trip_count").state, CommandState::kSucceeded);
}

TEST(Login, IsLostWithThePowerAndMadeOnceMoreForTheSameWrite) {
  DeviceFixture bench(kKeptKeys);
  bench.GoOnline();
  bench.unit.inputs[200] = 5;
  EXPECT_EQ(bench.Do("clear_trip_count").state, CommandState::kSucceeded) << bench.Last().text;
  bench.unit.inputs[200] = 6;
  EXPECT_EQ(bench.Do("clear_trip_count").state, CommandState::kSucceeded) << bench.Last().text;
  EXPECT_EQ(bench.unit.login_writes, 1) << "it is still logged in";
  bench.unit.inputs[200] = 7;
  bench.unit.PowerCycle();
  bench.sent.clear();
  EXPECT_EQ(bench.Do("clear_trip_count").state, CommandState::kSucceeded) << bench.Last().text;
  EXPECT_EQ(bench.unit.login_writes, 2);
  EXPECT_EQ(bench.Count({0x05, 0x00, 0x00}), 2) << "refused, and once more after the login";
  EXPECT_EQ(bench.unit.clears, 3);
}

// A unit that refuses although it reports logged in: one login, one repetition, no more.
TEST(Login, IsMadeOnceForAnOrderAtMost) {
  DeviceFixture bench(kKeptKeys);
  bench.GoOnline();
  bench.unit.inputs[200] = 5;
  bench.wire = [&](const ByteList& request) {
    if (request[1] == 0x05) return WithCrc({1, 0x85, 0x04});
    return bench.unit.Answer(request);
  };
  EXPECT_EQ(bench.Do("clear_trip_count").state, CommandState::kFailed);
  EXPECT_THAT(bench.Last().text, HasSubstr("error 04 (login error)"));
  EXPECT_EQ(bench.Count({0x05}), 2);
  EXPECT_EQ(bench.unit.login_writes, 1);
}

TEST(Login, ALostReplyToThePasswordIsClearedUpByReadingNotByWritingAgain) {
  DeviceFixture bench(kLoginKeys);
  bench.GoOnline();
  bool lost = false;
  bench.wire = [&](const ByteList& request) {
    ByteList reply = bench.unit.Answer(request);
    if (request[1] == 0x10 && !lost) {
      lost = true;
      reply.clear();
    }
    return reply;
  };
  EXPECT_EQ(bench.Do("log_in").state, CommandState::kSucceeded) << bench.Last().text;
  EXPECT_EQ(bench.unit.login_writes, 1);
}

TEST(Login, WithoutAPasswordNothingIsWritten) {
  DeviceFixture bench;
  bench.GoOnline();
  bench.unit.inputs[200] = 5;
  EXPECT_EQ(bench.Do("clear_trip_count").state, CommandState::kRejected);
  EXPECT_THAT(bench.Last().text, HasSubstr("the configuration names no password"));
  EXPECT_EQ(bench.Do("log_in").state, CommandState::kRejected);
  EXPECT_EQ(bench.unit.login_writes, 0);
}

TEST(Login, APasswordThatCannotBeReadOrIsNoneIsNamedNotShown) {
  DeviceFixture bench(kLoginKeys);
  bench.GoOnline();
  bench.secrets.files["/p/old"] = "short";
  EXPECT_EQ(bench.Do("log_in").state, CommandState::kFailed);
  EXPECT_THAT(bench.Last().text, HasSubstr("password old: its file does not hold a password"));
  EXPECT_THAT(bench.Last().text, testing::Not(HasSubstr("short")));
  bench.secrets.files.clear();
  EXPECT_EQ(bench.Do("log_in").state, CommandState::kFailed);
  EXPECT_THAT(bench.Last().text, HasSubstr("/p/old cannot be read"));
  EXPECT_EQ(bench.unit.login_writes, 0);
}

// So that a stop needs no login first.
TEST(Login, IsKeptUpWhereTheMotorIsControlled) {
  DeviceFixture bench(kFullKeys);
  bench.GoOnline();
  bench.RunUntil([&] { return bench.unit.logged_in; });
  EXPECT_EQ(bench.output.State("login_failed"), AlarmState::kAbsent);
  bench.unit.PowerCycle();
  bench.RunUntil([&] { return bench.unit.logged_in; }, 128 * 10);
  bench.secrets.files.clear();
  bench.unit.PowerCycle();
  bench.RunUntil([&] { return bench.output.State("login_failed") == AlarmState::kLive; }, 128 * 10);
  bench.secrets.files["/p/old"] = "password";
  bench.RunUntil([&] { return bench.unit.logged_in; }, 128 * 10);
  bench.Turns(4);
  EXPECT_EQ(bench.output.State("login_failed"), AlarmState::kAbsent);
}

TEST(Login, EveryFrameWithAPasswordIsMasked) {
  DeviceFixture bench(kLoginKeys);
  bench.unit.password = "Zq7!xyzw";
  bench.secrets.files["/p/old"] = bench.unit.password;
  bench.GoOnline();
  EXPECT_EQ(bench.Do("log_in").state, CommandState::kSucceeded);
  EXPECT_EQ(bench.Do("set_password", {{"name", "new"}}).state, CommandState::kSucceeded);
  EXPECT_EQ(bench.Do("check_password", {{"name", "new"}}).state, CommandState::kSucceeded);
  int masked = 0;
  for (const DeviceFixture::Sent& one : bench.sent) {
    const unsigned at = TestUnit::Word(one.request, 2);
    const bool holds =
        (one.request[1] == 0x10 && (at == 100 || at == 200)) || (one.request[1] == 0x03 && at == 200);
    EXPECT_EQ(one.secret, holds) << int{one.request[1]} << ' ' << at;
    masked += one.secret ? 1 : 0;
  }
  EXPECT_EQ(masked, 4);
  for (const auto& [id, outcome] : bench.output.outcomes) {
    for (const auto& [file, secret] : bench.secrets.files)
      EXPECT_THAT(outcome.text, testing::Not(HasSubstr(secret)));
  }
}

}  // namespace

}  // namespace axlecast::tsubaki_sc
