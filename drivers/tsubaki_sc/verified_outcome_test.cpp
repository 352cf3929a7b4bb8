// No operation claims an effect that its read-back would have shown without it (docs/commands.md).
#include <gtest/gtest.h>

#include "drivers/tsubaki_sc/device_test_support.h"

namespace axlecast::tsubaki_sc {
namespace {

bool IsWrite(const ByteList& request) { return request[1] == 0x05 || request[1] == 0x10 || request[1] == 0x06; }

TEST(VerifiedOutcome, AStartIsVerifiedOnlyWhereTheStopCoilGoesOff) {
  struct Case {
    bool stopped;
    bool reply;
    CommandState state;
    bool verified;
  };
  for (const Case& c : {Case{true, true, CommandState::kSucceeded, true},
                        {true, false, CommandState::kSucceeded, true},
                        {false, true, CommandState::kSucceeded, false},
                        {false, false, CommandState::kIndeterminate, false}}) {
    DeviceFixture bench("{address: 1, motor_control: start_stop, passwords: {old: {file: /p/old}}, password: old}");
    bench.unit.logged_in = true;
    bench.GoOnline();
    bench.unit.stop_coil = c.stopped;
    bench.wire = [&](const ByteList& request) {
      ByteList reply = bench.unit.Answer(request);
      return IsWrite(request) && !c.reply ? ByteList() : reply;
    };
    EXPECT_EQ(bench.Do("start_motor").state, c.state) << bench.Last().text;
    EXPECT_EQ(bench.Last().verified, c.verified) << bench.Last().text;
    EXPECT_LE(bench.Last().text.size(), 200U);
  }
}

// A value that is set already is not written, and the outcome states that.
TEST(VerifiedOutcome, WhatHeldAlreadyIsNamedSo) {
  DeviceFixture bench(kLoginKeys);
  bench.unit.logged_in = true;
  bench.GoOnline();
  bench.unit.inputs[200] = 0;
  EXPECT_EQ(bench.Do("clear_trip_count").state, CommandState::kSucceeded);
  EXPECT_NE(bench.Last().text.find("0 already: nothing was sent"), std::string::npos);
  EXPECT_EQ(bench.unit.clears, 0);
}

}  // namespace
}  // namespace axlecast::tsubaki_sc
