#include "drivers/tsubaki_sc/family.h"

#include <cmath>

#include "drivers/tsubaki_sc/device_test_support.h"

namespace axlecast::tsubaki_sc {
namespace {

const ByteList kAskMains = {0x02, 0x00, 0x00, 0x00, 0x01};
const ByteList kAskAnalog = {0x04, 0x00, 0x64, 0x00, 0x07};
const ByteList kAskStatus = {0x04, 0x00, 0xC8, 0x00, 0x05};

bool Asks(const ByteList& request, const ByteList& what) {
  return request.size() > what.size() && std::equal(what.begin(), what.end(), request.begin() + 1);
}

TEST(ScDevice, BeginsWithSilenceAndTheFence) {
  DeviceFixture bench;
  EXPECT_TRUE(bench.Offered().empty());
  bench.LinkUp();
  EXPECT_TRUE(std::holds_alternative<WaitForIdleLine>(bench.Peek().action));
  bench.BusSlot();
  bench.BusSlot();
  ASSERT_EQ(bench.sent.size(), 1u);
  EXPECT_EQ(bench.sent[0].request, WithCrc({1, 0x02, 0, 0, 0, 1}));
}

TEST(ScDevice, ReadsEverythingOnceAtTheStartBesideTheLiveData) {
  DeviceFixture bench;
  bench.unit.mains_60hz = true;
  bench.unit.stop_coil = true;
  bench.LinkUp();
  bench.Turns(28);
  for (const ByteList& item :
       {ByteList{0x01, 0, 100, 0, 1}, ByteList{0x04, 1, 0x2C, 0, 1}, ByteList{0x04, 0, 0, 0, 9},
        ByteList{0x03, 0, 0, 0, 19}, ByteList{0x03, 0, 19, 0, 18}, ByteList{0x03, 0, 37, 0, 18},
        ByteList{0x03, 1, 0x2C, 0, 2}, ByteList{0x03, 1, 0x5E, 0, 5}, ByteList{0x11}}) {
    EXPECT_EQ(bench.Count(item), 1) << int{item[0]};
  }
  EXPECT_EQ(bench.output.serial, "T123456789");
  EXPECT_EQ(bench.output.firmware, "1.0.0");
  EXPECT_EQ(bench.output.identity, 0x53433032);  // "SC02"
  EXPECT_EQ(bench.output.product_code, "SC02");  // ASCII: guideline 11
  ASSERT_FALSE(bench.output.motors.empty());
  const MotorReading& last = bench.output.motors.back();
  EXPECT_EQ(last.mains_hz, 60);
  EXPECT_EQ(last.stop_coil, 1);
  EXPECT_EQ(last.logged_in, 0);
  EXPECT_TRUE(bench.output.errors.empty());
}

TEST(ScDevice, PublishesLiveDataInSiUnits) {
  DeviceFixture bench;
  bench.GoOnline();
  bench.unit.inputs[103] = 0xFF85;  // -12.3 degrees C
  bench.Turns(2);
  ASSERT_EQ(bench.output.motors.size(), 1u);
  const MotorReading& motor = bench.output.motors[0];
  EXPECT_FLOAT_EQ(motor.voltage_v, 200.5F);
  EXPECT_FLOAT_EQ(motor.current_a, 1.234F);
  EXPECT_FLOAT_EQ(motor.power_w, 456.7F);
  EXPECT_FLOAT_EQ(motor.temperature_c, -12.3F);
  EXPECT_FLOAT_EQ(motor.accel_mps2[0], -1.00F);
  EXPECT_FLOAT_EQ(motor.accel_mps2[1], 0.25F);
  EXPECT_FLOAT_EQ(motor.accel_mps2[2], 9.81F);
  EXPECT_LT(motor.analog_at.last, motor.status_at.first);
  EXPECT_FALSE(motor.tripped);
}

TEST(ScDevice, TellsWhatTripsTheMotor) {
  DeviceFixture bench(kLoginKeys);
  bench.unit.holdings[52] = 905;    // 90.5 degrees C
  bench.unit.holdings[53] = 12345;  // 123.45 m/s^2
  bench.GoOnline();
  ASSERT_FALSE(bench.output.limits.empty());
  const MotorLimits limits = bench.output.limits.back();
  EXPECT_FLOAT_EQ(limits.power_upper_w[0], 100.0F);  // AI 0 to 8 hold 1000 to 1008
  EXPECT_FLOAT_EQ(limits.power_upper_w[1], 100.1F);
  EXPECT_FLOAT_EQ(limits.power_lower_w[0], 100.2F);
  EXPECT_FLOAT_EQ(limits.power_lower_w[1], 100.3F);
  EXPECT_FLOAT_EQ(limits.start_time_s, 100.4F);
  EXPECT_FLOAT_EQ(limits.shock_time_upper_s[0], 100.5F);
  EXPECT_FLOAT_EQ(limits.shock_time_upper_s[1], 100.6F);
  EXPECT_FLOAT_EQ(limits.shock_time_lower_s[0], 100.7F);
  EXPECT_FLOAT_EQ(limits.shock_time_lower_s[1], 100.8F);
  EXPECT_FLOAT_EQ(limits.overheat_c, 90.5F);
  EXPECT_FLOAT_EQ(limits.shock_mps2, 123.45F);
  EXPECT_FLOAT_EQ(limits.log_interval_s, 0.2F);
  for (unsigned i = 0; i <= 51; ++i)
    EXPECT_FLOAT_EQ(limits.parameters[i], 1.0F + 0.1F * static_cast<float>(i)) << i;
  EXPECT_FLOAT_EQ(limits.parameters[53], 123.45F);
  // A write is read back, and so is known at once.
  EXPECT_EQ(bench.Do("write_parameter", {{"name", "overheat_limit"}, {"value", "80"}}).state,
            CommandState::kSucceeded);
  EXPECT_FLOAT_EQ(bench.output.limits.back().overheat_c, 80.0F);
  // Another unit at the same address has its own.
  bench.unit.SetText(350, "T987654321");
  bench.RunUntil([&] { return bench.output.serial == "T987654321"; }, 128 * 20);
  const std::size_t before = bench.output.limits.size();
  bench.RunUntil([&] { return bench.output.limits.size() > before; }, 128 * 20);
  const MotorLimits& other = bench.output.limits.back();
  EXPECT_TRUE(std::isnan(other.overheat_c) || std::isnan(other.power_upper_w[0])) << "one block was read so far";
}

// device-facts: 267 ms a cycle, 3.74 Hz.
TEST(ScDevice, ALiveCycleTakesTwoExchangesAtReadingA) {
  DeviceFixture bench;
  bench.GoOnline();
  const MonoNs begin = bench.now;
  for (int i = 0; i < 20; ++i) bench.BusSlot();
  EXPECT_EQ(bench.output.motors.size(), 10u);
  EXPECT_NEAR(static_cast<double>(bench.now - begin) / 1e7, 267.3, 0.1);
  EXPECT_EQ(bench.Count(kAskAnalog), 10);
  EXPECT_EQ(bench.Count(kAskStatus), 10);
}

TEST(ScDevice, OneTurnIn128IsForASlowItemAndNoMore) {
  DeviceFixture bench;
  bench.GoOnline();
  bench.Turns(128 * 10);
  EXPECT_EQ(bench.Count({0x04}) - bench.Count(kAskAnalog) - bench.Count(kAskStatus) + bench.Count({0x01}) +
                bench.Count({0x02}) + bench.Count({0x03}) + bench.Count({0x11}),
            10);
  EXPECT_EQ(bench.Count({0x01, 0, 100}), 1);
  EXPECT_EQ(bench.Count({0x02}), 1);
}

TEST(ScDevice, ASlowItemThatTheUnitDoesNotKnowIsLeftOut) {
  DeviceFixture bench;
  bench.wire = [&](const ByteList& request) {
    if (request[1] == 0x11) return WithCrc({1, 0x91, 0x01});
    return bench.unit.Answer(request);
  };
  bench.LinkUp();
  bench.Turns(128 * 16);
  EXPECT_EQ(bench.Count({0x11}), 1);
  EXPECT_EQ(bench.output.Errors(ErrorKind::kException), 1);
}

TEST(ScDevice, BetweenItsSlotsItReadsTheOtherHalfAndTheSlowItemsOnceASecond) {
  DeviceFixture bench(kPlainKeys, 1.0);
  bench.GoOnline();
  for (int second = 0; second < 20; ++second) {
    const MonoNs slot = bench.now;
    bench.BusSlot(true);
    while (bench.now < slot + kSecond) {
      if (bench.BusSlot(false)) continue;
      bench.now = std::min(std::get<Idle>(bench.Peek(false).action).until, slot + kSecond);
    }
  }
  EXPECT_GE(bench.output.motors.size(), 19u);
  EXPECT_LE(bench.Count(kAskAnalog), 21);
  EXPECT_GE(bench.Count({0x02}) + bench.Count({0x01}), 4);
  EXPECT_LE(bench.sent.size(), 63u);
}

TEST(ScDevice, AskingChangesNothing) {
  DeviceFixture bench;
  bench.GoOnline();
  for (int i = 0; i < 200; ++i) {
    const ByteList once = bench.Offered();
    static_cast<void>(bench.Offered(false));
    EXPECT_EQ(bench.Offered(), once);
    bench.Turns(1);
  }
}

TEST(ScDevice, AfterATimeoutItIsSilentAndAsksTheFenceFirst) {
  DeviceFixture bench;
  bench.GoOnline();
  const auto answer = bench.wire;
  bench.wire = [](const ByteList&) { return ByteList(); };
  bench.BusSlot();
  bench.wire = answer;
  bench.now -= kCommandPause;  // before the pause that the bus makes
  EXPECT_TRUE(std::holds_alternative<WaitForIdleLine>(bench.Peek().action));
  EXPECT_EQ(std::get<WaitForIdleLine>(bench.Peek().action).quiet, 25 * kMillisecond);
  bench.BusSlot();
  EXPECT_TRUE(Asks(bench.Offered(), kAskMains));
  EXPECT_TRUE(bench.Offered(false).empty());  // in its own turn only
  bench.BusSlot();
  EXPECT_FALSE(Asks(bench.Offered(), kAskMains));
  EXPECT_EQ(bench.output.Errors(ErrorKind::kTimeout), 1);
}

// Each reply comes one request late, as after a time-out that was too short.
TEST(ScDevice, ALateReplyIsNeverTakenForALaterOne) {
  DeviceFixture bench;
  bench.GoOnline();
  bench.unit.Trip(0x01, 100);
  bench.Turns(3);  // the trip is seen, its log begun
  ByteList late;
  bool slow = false;
  int delayed = 0;
  bench.wire = [&](const ByteList& request) {
    ByteList reply = bench.unit.Answer(request);
    if (!slow && request[1] == 0x04 && TestUnit::Word(request, 2) == 1200) {
      slow = true;
      late = reply;
      return ByteList();
    }
    if (slow && ++delayed <= 4) std::swap(reply, late);
    return reply;
  };
  // The blocks differ, so that a mix-up shows.
  for (unsigned quantity = 0; quantity < 7; ++quantity) {
    for (unsigned i = 0; i < 20; ++i) {
      bench.unit.inputs[1000 + 100 * quantity + i] = static_cast<std::uint16_t>(1000 + 10 * quantity);
    }
  }
  bench.RunUntil([&] { return !bench.output.trips.empty(); });
  const TripRecord& trip = bench.output.trips[0];
  EXPECT_EQ(trip.valid_mask, 0x7F);
  const float divisors[] = {10, 1000, 10, 10, 100, 100, 100};
  for (std::size_t q = 1; q < 7; ++q) {
    EXPECT_FLOAT_EQ(trip.samples[q][7], static_cast<float>(1000 + 10 * q) / divisors[q]) << q;
  }
  EXPECT_GE(bench.output.Errors(ErrorKind::kWrongEcho), 1);
}

TEST(ScDevice, AnotherUnitsReplyIsAWrongEchoAndNoReading) {
  DeviceFixture bench;
  bench.GoOnline();
  TestUnit other;
  other.address = 2;
  bench.wire = [&](ByteList request) {
    request.resize(request.size() - 2);
    request[0] = 2;
    return other.Answer(WithCrc(request));
  };
  bench.Turns(6);
  EXPECT_TRUE(bench.output.motors.empty());
  EXPECT_GE(bench.output.Errors(ErrorKind::kWrongEcho), 2);
  EXPECT_EQ(bench.Count({0x04}), 1);  // all others were fences
}

TEST(ScDevice, ASilentUnitIsAskedForTheFenceOnlyAndLookedAtAnewWhenItIsBack) {
  DeviceFixture bench;
  bench.GoOnline();
  const auto answer = bench.wire;
  bench.wire = [](const ByteList&) { return ByteList(); };
  bench.Turns(20);
  EXPECT_GE(bench.Count({0x02}), 8);
  EXPECT_EQ(bench.Count({0x04}), 1);
  EXPECT_TRUE(bench.Offered(false).empty());
  bench.wire = answer;
  bench.unit.SetText(350, "T000000007");
  bench.unit.Trip(0x20, 1);
  bench.sent.clear();
  bench.Turns(2);
  EXPECT_TRUE(Asks(bench.sent.back().request, {0x03, 1, 0x5E, 0, 5}));  // whose it is comes first
  bench.Turns(4);
  // Another unit: its trip did not happen while the driver watched.
  bench.RunUntil([&] { return !bench.output.trips.empty(); }, 128 * 30);
  EXPECT_EQ(bench.output.trips[0].not_before, 0);
}

TEST(ScDevice, DamagedRepliesAreErrorsByKind) {
  struct Case {
    const char* what;
    ErrorKind kind;
    std::function<void(ByteList&)> damage;
  };
  const Case cases[] = {
      {"flip", ErrorKind::kChecksum, [](ByteList& reply) { reply[4] ^= 0x10; }},
      {"short", ErrorKind::kShort, [](ByteList& reply) { reply.pop_back(); }},
      {"function", ErrorKind::kWrongEcho,
       [](ByteList& reply) {
         reply.resize(reply.size() - 2);
         reply[1] = 0x03;
         reply = WithCrc(reply);
       }},
      {"fewer registers", ErrorKind::kRange,
       [](ByteList& reply) {
         reply = WithCrc({1, 0x04, 2, 0, 0});
       }},
      {"exception", ErrorKind::kException,
       [](ByteList& reply) {
         reply = WithCrc({1, 0x84, 0x02});
       }},
  };
  for (const Case& c : cases) {
    DeviceFixture bench;
    bench.GoOnline();
    bench.wire = [&](const ByteList& request) {
      ByteList reply = bench.unit.Answer(request);
      if (request[1] == 0x04) c.damage(reply);
      return reply;
    };
    bench.BusSlot();
    EXPECT_EQ(bench.output.Errors(c.kind), 1) << c.what;
    EXPECT_EQ(bench.output.errors.size(), 1u) << c.what;
    EXPECT_TRUE(bench.output.motors.empty()) << c.what;
  }
}

TEST(ScDevice, AHalfThatFailsHoldsTheOtherBackOnlyOnce) {
  DeviceFixture bench;
  bench.GoOnline();
  bench.wire = [&](const ByteList& request) {
    return Asks(request, kAskStatus) ? ByteList() : bench.unit.Answer(request);
  };
  bench.Turns(12);
  EXPECT_GE(bench.output.motors.size(), 3u);
  EXPECT_GE(bench.Count(kAskAnalog), 3);
}

TEST(ScDevice, StrayBytesCostSilenceOnceForAllUnits) {
  DeviceFixture bench;
  bench.GoOnline();
  bench.Stray({0x01, 0x04});
  EXPECT_TRUE(std::holds_alternative<WaitForIdleLine>(bench.Peek().action));
  bench.now += 25 * kMillisecond;  // another unit on the bus has kept it
  EXPECT_FALSE(std::holds_alternative<WaitForIdleLine>(bench.Peek().action));
  EXPECT_EQ(bench.output.Errors(ErrorKind::kUnexpectedBytes), 1);
  EXPECT_FALSE(Asks(bench.Offered(), kAskMains));
}

TEST(ScDevice, MotorStatusBitsAreAlarmsWithTheMakersNames) {
  DeviceFixture bench;
  bench.GoOnline();
  const std::pair<unsigned, const char*> bits[] = {{0, "power_upper_limit_a"},
                                                   {1, "power_upper_limit_b"},
                                                   {2, "power_lower_limit_a"},
                                                   {3, "power_lower_limit_b"},
                                                   {5, "overheat"},
                                                   {6, "excessive_shock"}};
  for (const auto& [bit, name] : bits) {
    bench.unit.inputs[201] = static_cast<std::uint16_t>(1U << bit);
    bench.Turns(2);
    for (const auto& [other, other_name] : bits) {
      EXPECT_EQ(bench.output.State(other_name), other == bit ? AlarmState::kLive : AlarmState::kAbsent) << name;
    }
    EXPECT_TRUE(bench.output.motors.back().tripped);
    EXPECT_EQ(bench.output.motors.back().status_bits, 1 << bit);
  }
  bench.unit.inputs[201] = 0;
  bench.Turns(2);
  EXPECT_EQ(bench.output.State("excessive_shock"), AlarmState::kAbsent);
  EXPECT_FALSE(bench.output.motors.back().tripped);
}

TEST(ScDevice, TheLinkMayComeAndGo) {
  DeviceFixture bench;
  bench.GoOnline();
  bench.Begin("read_parameters");
  bench.LinkDown();
  EXPECT_EQ(bench.Last().state, CommandState::kFailed);
  EXPECT_TRUE(bench.Offered().empty());
  bench.LinkUp();
  bench.BusSlot();
  EXPECT_TRUE(Asks(bench.Offered(), kAskMains));
}

}  // namespace

}  // namespace axlecast::tsubaki_sc
