#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <yaml-cpp/yaml.h>
#include <vector>

#include "core/config/config_map.h"
#include "core/config/machine_config.h"
#include "drivers/kit/simulation/simulated_fault.h"
#include "drivers/tformat/family.h"

namespace axlecast::tformat {

namespace {

using testing::HasSubstr;

constexpr MonoNs kMadeAt = 100 * kSecond;

class SimulatorScriptTest : public testing::Test {
 protected:
  SimulatorScriptTest() {
    bus_.name = "rs485-0";
    bus_.devices.emplace_back();
    bus_.devices.front().name = "axis1";
  }

  // The simulator of this mapping, started at kMadeAt; its errors.
  std::string Make(const std::string& yaml) {
    ConfigErrors errors("machine.yaml");
    ConfigMap map(YAML::Load(yaml), "simulate", errors);
    simulator_ = MakeTFormatSimulator(bus_, map);
    map.Done();
    if (simulator_) simulator_->OnDue(kMadeAt, [](Bytes) {});
    return errors.Text();
  }
  void RunUntil(MonoNs until) {
    while (simulator_->NextDue() <= until) simulator_->OnDue(simulator_->NextDue(), [](Bytes) {});
    simulator_->OnDue(until, [](Bytes) {});
  }
  std::string Value(const std::string& key, MonoNs at) {
    for (const auto& [name, value] : simulator_->State("axis1", at)) {
      if (name == key) return value;
    }
    return "absent";
  }

  BusConfig bus_;
  std::unique_ptr<Simulator> simulator_;
};

TEST_F(SimulatorScriptTest, WithoutKeysItStandsAtZeroAtTheWiresPace) {
  ASSERT_EQ(Make("{}"), "");
  EXPECT_EQ(Value("speed_rpm", kMadeAt), "0");
  EXPECT_EQ(Value("pace", kMadeAt), "wire");
  EXPECT_EQ(Value("battery_v", kMadeAt), "3.6");
  EXPECT_EQ(Value("enid", kMadeAt), "17");
  EXPECT_EQ(Value("single_turn", kMadeAt), "0");
}

TEST_F(SimulatorScriptTest, StepsHappenAtTheirInstants) {
  ASSERT_EQ(
      Make("axis1:\n"
           "  {speed_rpm: 60, start_deg: 10, battery_v: 3.6, pace: wire,\n"
           "   script: [{at_s: 5, battery_v: 3.0}, {at_s: 9, fault: bit_flip:0.001}, {at_s: 12, fault: none}]}\n"),
      "");
  EXPECT_NEAR(std::stod(Value("angle_deg", kMadeAt)), 10, 1e-6);
  RunUntil(kMadeAt + 5 * kSecond - 1);
  EXPECT_EQ(Value("alarms", kMadeAt + 5 * kSecond - 1), "none");
  EXPECT_EQ(simulator_->NextDue(), kMadeAt + 5 * kSecond);
  RunUntil(kMadeAt + 5 * kSecond);
  EXPECT_EQ(Value("alarms", kMadeAt + 5 * kSecond), "BA");
  RunUntil(kMadeAt + 10 * kSecond);
  EXPECT_EQ(Value("fault", kMadeAt + 10 * kSecond), "bit_flip:0.001");
  RunUntil(kMadeAt + 100 * kSecond);
  EXPECT_EQ(Value("fault", kMadeAt + 100 * kSecond), "none");
  EXPECT_EQ(simulator_->NextDue(), kNever);
}

TEST_F(SimulatorScriptTest, AStepThatIsServedLateStillActsAtItsInstant) {
  ASSERT_EQ(Make("axis1: {accel_rad_s2: 200000, script: [{at_s: 1, speed_rpm: 60}]}"), "");
  simulator_->OnDue(kMadeAt + 11 * kSecond, [](Bytes) {});
  EXPECT_NEAR(std::stod(Value("angle_deg", kMadeAt + 11 * kSecond)), 3'600, 0.1);
}

TEST_F(SimulatorScriptTest, ComesAgainAfterItsPeriod) {
  ASSERT_EQ(Make("axis1: {script_period_s: 10, script: [{at_s: 1, battery_v: 3.0}, {at_s: 2, battery_v: 3.6}]}"),
            "");
  for (int round = 0; round < 3; ++round) {
    const MonoNs begin = kMadeAt + round * 10 * kSecond;
    RunUntil(begin + 1'500 * kMillisecond);
    EXPECT_EQ(Value("battery_v", begin + 1'500 * kMillisecond), "3") << round;
    RunUntil(begin + 9 * kSecond);
    EXPECT_EQ(Value("battery_v", begin + 9 * kSecond), "3.6") << round;
  }
}

// As in the demo: the battery-backed counter turned too fast while off, then powered on.
TEST_F(SimulatorScriptTest, AnOverSpeedDevelops) {
  ASSERT_EQ(Make("axis1: {script: [{at_s: 1, power: off}, {at_s: 2, speed_rpm: 7000}, {at_s: 4, speed_rpm: 50},\n"
                 "                 {at_s: 6, power: on}]}"),
            "");
  RunUntil(kMadeAt + 8 * kSecond);
  EXPECT_EQ(Value("alarms", kMadeAt + 8 * kSecond), "OS");
}

TEST_F(SimulatorScriptTest, AnOverflowDevelops) {
  ASSERT_EQ(Make("axis1: {start_turns: 65535, start_deg: 180, speed_rpm: 60}"), "");
  EXPECT_EQ(Value("alarms", kMadeAt), "none");
  EXPECT_EQ(Value("multi_turn", kMadeAt), "65535");
  EXPECT_EQ(Value("alarms", kMadeAt + kSecond), "OF");
  EXPECT_EQ(Value("multi_turn", kMadeAt + kSecond), "0");
}

TEST_F(SimulatorScriptTest, MistakesAreNamedWithTheirLine) {
  EXPECT_THAT(Make("axis1:\n  speed: 60\n"), HasSubstr("machine.yaml:2:"));
  EXPECT_THAT(Make("axis1:\n  sped_rpm: 60\n"), HasSubstr("did you mean 'speed_rpm'"));
  EXPECT_THAT(Make("axis1:\n  pace: wire\n  battery_v: 12\n"),
              HasSubstr("machine.yaml:3:14: simulate.axis1.battery_v: '12'"));
  EXPECT_THAT(Make("axis1: {script: [{battery_v: 3}]}"), HasSubstr("at_s: is missing"));
  EXPECT_THAT(Make("axis1: {script: [{at_s: 2, power: off}, {at_s: 1, power: on}]}"), HasSubstr("in the order"));
  EXPECT_THAT(Make("axis1: {script: [{at_s: 2, start_deg: 1}]}"), HasSubstr("unknown key 'start_deg'"));
  EXPECT_THAT(Make("axis1: {script_period_s: 2, script: [{at_s: 2, power: off}]}"), HasSubstr("later than"));
  EXPECT_THAT(Make("axis1: {motion: stop, speed_rpm: 3}"), HasSubstr("excludes motion"));
  EXPECT_THAT(Make("axis1: {start_turns: 65536}"), HasSubstr("65535"));
  EXPECT_THAT(Make("axis9: {speed_rpm: 60}"), HasSubstr("unknown key 'axis9'"));
}

using testing::ElementsAre;
using testing::IsEmpty;
using testing::SizeIs;
using ByteList = std::vector<std::uint8_t>;

constexpr MonoNs kStart = 5'000 * kSecond;

struct Delivery {
  MonoNs at;
  ByteList bytes;
};

// A simulator and its line in virtual time.
class DeviceFixture {
 public:
  explicit DeviceFixture(const std::string& pace, bool echo = false) {
    BusConfig bus;
    bus.link.echo = echo;
    bus.devices.emplace_back();
    bus.devices.front().name = "axis1";
    ConfigErrors errors("machine.yaml");
    ConfigMap map(YAML::Load("axis1: {start_turns: 7, start_deg: 90, pace: " + pace + "}"), "simulate", errors);
    simulator_ = MakeTFormatSimulator(bus, map);
    EXPECT_TRUE(simulator_) << errors.Text();
  }

  void Send(const ByteList& bytes) {
    simulator_->OnBytes(bytes, now_, [this](Bytes out) { Store(out); });
  }
  // Lets time pass; everything happens at its instant.
  void Pass(MonoNs time) {
    const MonoNs until = now_ + time;
    while (simulator_->NextDue() <= until) {
      now_ = std::max(now_, simulator_->NextDue());
      simulator_->OnDue(now_, [this](Bytes out) { Store(out); });
    }
    now_ = until;
  }
  // What comes within a second.
  ByteList Ask(const ByteList& request) {
    deliveries_.clear();
    Send(request);
    Pass(30 * kMillisecond);
    return deliveries_.size() == 1 ? deliveries_[0].bytes : ByteList();
  }
  void Set(const std::string& key, const std::string& value) {
    EXPECT_EQ(ErrorText(simulator_->Set("axis1", key, value, now_)), "");
  }
  std::string Value(const std::string& key) {
    for (const auto& [name, value] : simulator_->State("axis1", now_)) {
      if (name == key) return value;
    }
    return "absent";
  }

  Simulator& simulator() { return *simulator_; }
  std::vector<Delivery>& deliveries() { return deliveries_; }
  [[nodiscard]] MonoNs now() const { return now_; }

 private:
  void Store(Bytes bytes) { deliveries_.push_back({now_, ByteList(bytes.begin(), bytes.end())}); }

  std::unique_ptr<Simulator> simulator_;
  std::vector<Delivery> deliveries_;
  MonoNs now_ = kStart;
};

// At 90 deg ABS is 0x008000, ABM is 7. Lengths and fields as in TS5669 spec Table 2; the last byte makes the XOR 0.
TEST(SimulatorTest, AnswersEveryReadout) {
  DeviceFixture bench("unpaced");
  EXPECT_THAT(bench.Ask({0x02}), ElementsAre(0x02, 0x00, 0x00, 0x80, 0x00, 0x82));
  EXPECT_THAT(bench.Ask({0x8A}), ElementsAre(0x8A, 0x00, 0x07, 0x00, 0x00, 0x8D));
  EXPECT_THAT(bench.Ask({0x92}), ElementsAre(0x92, 0x00, 0x11, 0x83));
  EXPECT_THAT(bench.Ask({0x1A}),
              ElementsAre(0x1A, 0x00, 0x00, 0x80, 0x00, 0x11, 0x07, 0x00, 0x00, 0x00, 0x1A ^ 0x80 ^ 0x11 ^ 0x07));
  for (const std::uint8_t reset : std::initializer_list<std::uint8_t>{0xBA, 0xC2, 0x62}) {
    EXPECT_THAT(bench.Ask({reset}), ElementsAre(reset, 0x00, 0x00, 0x80, 0x00, reset ^ 0x80));
  }
}

// An encoder without battery sends SF = 20 (public captures) and ALMC = BE and BA.
TEST(SimulatorTest, AlarmsStandInStatusFieldAndAlmc) {
  DeviceFixture bench("unpaced");
  bench.Set("battery_v", "0");
  ByteList reply = bench.Ask({0x1A});
  ASSERT_THAT(reply, SizeIs(11));
  EXPECT_EQ(reply[1], 0x20);
  EXPECT_EQ(reply[9], 0xC0);
  bench.Set("battery_v", "3.0");
  bench.Set("counting_error", "live");
  reply = bench.Ask({0x1A});
  ASSERT_THAT(reply, SizeIs(11));
  EXPECT_EQ(reply[1], 0x30);
  EXPECT_EQ(reply[9], 0xC4) << "BE stays latched, BA live, CE";
  EXPECT_EQ(bench.Value("alarms"), "CE BE BA");
}

// ---- timing: spec 7.1, 2.5 Mbit/s ----

TEST(SimulatorTest, OnTheWireAReplyEnds3MicrosecondsAnd4PerByteAfterTheRequest) {
  DeviceFixture bench("wire");
  bench.Send({0x1A});
  EXPECT_THAT(bench.deliveries(), IsEmpty());
  bench.Pass(kMillisecond);
  ASSERT_THAT(bench.deliveries(), SizeIs(1));
  EXPECT_EQ(bench.deliveries()[0].at - kStart, 51 * kMicrosecond);
  bench.Send({0x02});
  const MonoNs sent = bench.now();
  bench.Pass(kMillisecond);
  EXPECT_EQ(bench.deliveries().back().at - sent, 31 * kMicrosecond);
}

TEST(SimulatorTest, UnpacedRepliesComeAtOnce) {
  DeviceFixture bench("unpaced");
  bench.Send({0x1A});
  ASSERT_THAT(bench.deliveries(), SizeIs(1));
  bench.Send({0x1A});
  ASSERT_THAT(bench.deliveries(), SizeIs(2));
  EXPECT_EQ(bench.Value("collisions"), "0");
}

TEST(SimulatorTest, SlotsAreAbsolute) {
  DeviceFixture bench("slots");
  bench.Pass(7 * kMicrosecond);
  bench.Send({0x1A});
  bench.Pass(kMillisecond);
  ASSERT_THAT(bench.deliveries(), SizeIs(1));
  EXPECT_EQ(bench.deliveries()[0].at % (51 * kMicrosecond), 0);
  EXPECT_LE(bench.deliveries()[0].at - kStart, 7 * kMicrosecond + 51 * kMicrosecond);
}

TEST(SimulatorTest, AddressedWhileItTransmitsItComplainsAndTheReplyIsLost) {
  DeviceFixture bench("wire");
  bench.Send({0x1A});
  bench.Pass(50 * kMicrosecond);
  bench.Send({0x1A});
  bench.Pass(kMillisecond);
  EXPECT_THAT(bench.deliveries(), IsEmpty());
  EXPECT_EQ(bench.Value("collisions"), "1");
  EXPECT_THAT(bench.Ask({0x1A}), SizeIs(11)) << "it continues";
}

TEST(SimulatorTest, TwoRequestsInOneBreathAreACollision) {
  DeviceFixture bench("unpaced");
  bench.Send({0x1A, 0x1A});
  EXPECT_EQ(bench.Value("collisions"), "1");
  EXPECT_THAT(bench.deliveries(), SizeIs(1));
}

TEST(SimulatorTest, APauseAfterTheReplyIsEnough) {
  DeviceFixture bench("wire");
  for (int i = 0; i < 100; ++i) {
    bench.Send({0x1A});
    bench.Pass(51 * kMicrosecond);
  }
  EXPECT_THAT(bench.deliveries(), SizeIs(100));
  EXPECT_EQ(bench.Value("collisions"), "0");
}

// ---- abnormal requests: spec Tables 5 and 6 ----

TEST(SimulatorTest, AbnormalRequestsGetDataOfId3) {
  DeviceFixture bench("unpaced");
  // ID 4 (cc2 = 1, parity 1) does not exist.
  EXPECT_THAT(bench.Ask({0xA2}), SizeIs(11));
  EXPECT_THAT(bench.Ask({0xEA, 0x50, 0xEA ^ 0x50}), SizeIs(11)) << "address 80";
  EXPECT_THAT(bench.Ask({0xEA, 0x00, 0x00}), SizeIs(11)) << "CRC";
  EXPECT_EQ(bench.Ask({0xA2})[0], 0x1A);
  bench.Set("abnormal_echo", "request");
  EXPECT_EQ(bench.Ask({0xA2})[0], 0xA2);
  EXPECT_EQ(bench.Ask({0xA2})[1], 0x00);
  EXPECT_EQ(bench.Value("abnormal_requests"), "6");
}

TEST(SimulatorTest, AParityErrorRaisesItsCommunicationAlarm) {
  DeviceFixture bench("unpaced");
  const ByteList reply = bench.Ask({0x9A});  // ID 3 with the parity bit of an odd ID
  ASSERT_THAT(reply, SizeIs(11));
  EXPECT_EQ(reply[1], 0x40);
}

TEST(SimulatorTest, ADelimiterErrorRaisesItsCommunicationAlarm) {
  DeviceFixture bench("unpaced");
  bench.Set("fault", "request_flip:0.02");
  bool seen = false;
  for (int i = 0; i < 10'000 && !seen; ++i) {
    const ByteList reply = bench.Ask({0x1A});
    seen = reply.size() == 11 && reply[1] == 0x80;
  }
  EXPECT_TRUE(seen);
}

TEST(SimulatorTest, AWrongSinkCodeGetsNoAnswer) {
  DeviceFixture bench("unpaced");
  EXPECT_THAT(bench.Ask({0x1B}), IsEmpty());
  EXPECT_THAT(bench.Ask({0x00}), IsEmpty());
  EXPECT_EQ(bench.Value("bad_sync"), "2");
}

TEST(SimulatorTest, ARequestThatEndsEarlyIsAbnormal) {
  DeviceFixture bench("unpaced");
  EXPECT_THAT(bench.Ask({0xEA}), SizeIs(11));
  bench.Send({0xEA});
  bench.Pass(500 * kMicrosecond);
  bench.Send({0x00, 0xEA});
  EXPECT_THAT(bench.deliveries().back().bytes, ElementsAre(0xEA, 0x00, 0x00, 0xEA)) << "in two pieces";
}

// ---- EEPROM: spec Table 4 ----

TEST(SimulatorTest, EepromWriteIsAcceptedThenBusyThenReadBack) {
  DeviceFixture bench("unpaced");
  bench.Send({0x32, 0x00, 0x55, 0x67});
  EXPECT_THAT(bench.deliveries().back().bytes, ElementsAre(0x32, 0x00, 0x55, 0x67));
  bench.Send({0xEA, 0x00, 0xEA});
  EXPECT_THAT(bench.deliveries().back().bytes, ElementsAre(0xEA, 0x80, 0x00, 0x6A)) << "busy";
  bench.Send({0x32, 0x01, 0x77, 0x32 ^ 0x01 ^ 0x77});
  EXPECT_THAT(bench.deliveries().back().bytes, ElementsAre(0x32, 0x81, 0x00, 0xB3)) << "busy: nothing is written";
  bench.Pass(18 * kMillisecond);
  EXPECT_THAT(bench.Ask({0xEA, 0x00, 0xEA}), ElementsAre(0xEA, 0x00, 0x55, 0xBF));
  EXPECT_THAT(bench.Ask({0xEA, 0x01, 0xEB}), ElementsAre(0xEA, 0x01, 0x00, 0xEB));
  EXPECT_EQ(bench.Value("eeprom_writes"), "1");
  EXPECT_EQ(bench.Value("eeprom_wear"), "1");
}

// ---- resets over the line ----

TEST(SimulatorTest, TenTurnResetsOverTheLineActOnce) {
  DeviceFixture bench("wire");
  for (int i = 0; i < 10; ++i) {
    const ByteList reply = bench.Ask({0x62});
    ASSERT_THAT(reply, SizeIs(6));
    bench.Pass(10 * kMillisecond);
  }
  EXPECT_EQ(bench.Value("turn_resets"), "1");
  EXPECT_EQ(bench.Ask({0x8A})[2], 0x00);
}

TEST(SimulatorTest, TheTenthReplyStillShowsTheErrorThatItClears) {
  DeviceFixture bench("unpaced");
  bench.Set("multi_turn_jump", "1");
  for (int i = 0; i < 10; ++i) {
    EXPECT_EQ(bench.Ask({0xBA})[1], 0x20);
    bench.Pass(10 * kMillisecond);
  }
  EXPECT_EQ(bench.Ask({0x02})[1], 0x00);
  EXPECT_EQ(bench.Value("error_clears"), "1");
}

TEST(SimulatorTest, AReadoutBetweenResetsBreaksTheSequence) {
  DeviceFixture bench("unpaced");
  for (int i = 0; i < 30; ++i) {
    static_cast<void>(bench.Ask({0x62}));
    bench.Pass(20 * kMillisecond);
    if (i % 9 == 8) static_cast<void>(bench.Ask({0x1A}));
  }
  EXPECT_EQ(bench.Value("turn_resets"), "0");
}

// ---- faults ----

TEST(SimulatorTest, Off) {
  DeviceFixture bench("unpaced");
  bench.Set("fault", "off");
  EXPECT_THAT(bench.Ask({0x1A}), IsEmpty());
  bench.Set("fault", "none");
  EXPECT_THAT(bench.Ask({0x1A}), SizeIs(11));
  EXPECT_EQ(bench.Value("unanswered"), "1");
}

TEST(SimulatorTest, PowerCycleIsFollowedByAStandby) {
  DeviceFixture bench("unpaced");
  bench.Set("power", "cycle");
  EXPECT_THAT(bench.Ask({0x1A}), IsEmpty());
  bench.Pass(kSecond);
  EXPECT_THAT(bench.Ask({0x1A}), SizeIs(11));
}

TEST(SimulatorTest, EchoComesBeforeTheReply) {
  DeviceFixture bench("wire", true);
  bench.Send({0x02});
  bench.Pass(kMillisecond);
  ASSERT_THAT(bench.deliveries(), SizeIs(2));
  EXPECT_EQ(bench.deliveries()[0].at, kStart);
  EXPECT_THAT(bench.deliveries()[0].bytes, ElementsAre(0x02));
  EXPECT_THAT(bench.deliveries()[1].bytes, SizeIs(6));
}

TEST(SimulatorTest, ADelayedReplyComesLateAndIsNoCollision) {
  DeviceFixture bench("wire");
  bench.Set("fault", "delayed:20");
  bench.Send({0x1A});
  bench.Pass(5 * kMillisecond);
  EXPECT_THAT(bench.deliveries(), IsEmpty());
  bench.Send({0x02});
  bench.Pass(40 * kMillisecond);
  ASSERT_THAT(bench.deliveries(), SizeIs(2));
  EXPECT_EQ(bench.deliveries()[0].at - kStart, 20 * kMillisecond + 51 * kMicrosecond);
  EXPECT_THAT(bench.deliveries()[0].bytes, SizeIs(11));
  EXPECT_EQ(bench.Value("collisions"), "0");
}

TEST(SimulatorTest, ASlowReplyHoldsTheLine) {
  DeviceFixture bench("wire");
  bench.Set("fault", "slow:1000");
  bench.Send({0x1A});
  bench.Pass(500 * kMicrosecond);
  bench.Send({0x1A});  // the host did not wait for silence
  bench.Pass(2 * kMillisecond);
  EXPECT_EQ(bench.Value("collisions"), "1");
  EXPECT_THAT(bench.deliveries(), IsEmpty());
}

TEST(SimulatorTest, AFloodOfDelayedRepliesIsBounded) {
  DeviceFixture bench("wire");
  bench.Set("fault", "delayed:1000");
  for (int i = 0; i < 1'000; ++i) {
    bench.Send({0x1A});
    bench.Pass(60 * kMicrosecond);
  }
  bench.Pass(2 * kSecond);
  EXPECT_LE(bench.deliveries().size(), 32U);
  EXPECT_THAT(bench.deliveries(), testing::Not(IsEmpty()));
}

TEST(SimulatorTest, IntermittentLosesTheReplyNotTheRequest) {
  DeviceFixture bench("unpaced");
  bench.Set("fault", "intermittent:1");
  for (int i = 0; i < 10; ++i) {
    EXPECT_THAT(bench.Ask({0x62}), IsEmpty());
    bench.Pass(10 * kMillisecond);
  }
  EXPECT_EQ(bench.Value("turn_resets"), "1");
}

TEST(SimulatorTest, GarbageHasTheLengthButNotTheSense) {
  DeviceFixture bench("unpaced");
  bench.Set("fault", "garbage");
  const ByteList first = bench.Ask({0x1A});
  EXPECT_THAT(first, SizeIs(11));
  EXPECT_NE(first, bench.Ask({0x1A}));
}

// Whatever comes in whatever pieces: once the line has been silent it answers as before.
TEST(SimulatorTest, AnyBytesAtAnyTime) {
  SeededRandom random(7);
  for (const char* pace : {"unpaced", "wire", "slots"}) {
    DeviceFixture bench(pace);
    for (int i = 0; i < 100'000; ++i) {
      ByteList bytes(1 + random.Next() % 12);
      for (std::uint8_t& byte : bytes) byte = static_cast<std::uint8_t>(random.Next());
      bench.Send(bytes);
      bench.Pass(static_cast<MonoNs>(random.Next() % 100) * kMicrosecond);
    }
    bench.Pass(kSecond);
    EXPECT_THAT(bench.Ask({0x92}), ElementsAre(0x92, 0x00, 0x11, 0x83)) << pace;
    EXPECT_EQ(bench.Value("zeroings"), "0");
    EXPECT_EQ(bench.Value("turn_resets"), "0");
  }
}

// ---- changes while it runs ----

TEST(SimulatorTest, SpeedIsSetInRpm) {
  DeviceFixture bench("unpaced");
  bench.Set("speed_rpm", "600");
  bench.Pass(10 * kSecond);
  EXPECT_EQ(bench.Value("speed_rpm"), "600");
  EXPECT_NEAR(std::stod(bench.Value("multi_turn")), 107, 1);
}

TEST(SimulatorTest, RefusesWithTheReason) {
  DeviceFixture bench("unpaced");
  Simulator& simulator = bench.simulator();
  EXPECT_THAT(ErrorText(simulator.Set("axis2", "speed_rpm", "1", kStart)), HasSubstr("there is axis1"));
  EXPECT_THAT(ErrorText(simulator.Set("axis1", "speed", "1", kStart)), HasSubstr("speed_rpm"));
  EXPECT_THAT(ErrorText(simulator.Set("axis1", "speed_rpm", "fast", kStart)),
              HasSubstr("axis1.speed_rpm: 'fast' is not a number"));
  EXPECT_THAT(ErrorText(simulator.Set("axis1", "battery_v", "5", kStart)), HasSubstr("0 to 4.75 V"));
  EXPECT_THAT(ErrorText(simulator.Set("axis1", "motion", "sine:360,0.01", kStart)), HasSubstr("accel_rad_s2"));
  EXPECT_THAT(ErrorText(simulator.Set("axis1", "motion", "sine:360", kStart)),
              HasSubstr("sine:AMPLITUDE_DEG,PERIOD_S"));
  EXPECT_THAT(ErrorText(simulator.Set("axis1", "eeprom", "79=01 02", kStart)), HasSubstr("CELL=BYTES"));
  EXPECT_THAT(ErrorText(simulator.Set("axis1", "enid", "256", kStart)), HasSubstr("0 to 255"));
  EXPECT_THAT(ErrorText(simulator.Set("axis1", "power", "maybe", kStart)), HasSubstr("on, off, cycle"));
  EXPECT_THAT(ErrorText(simulator.Set("axis1", "multi_turn_jump", "1.5", kStart)), HasSubstr("whole number"));
}

TEST(SimulatorTest, EveryQuantityIsShown) {
  DeviceFixture bench("unpaced");
  for (const char* name : {"pace", "slot_us", "enid", "abnormal_echo", "noise_counts", "zero_error_deg", "eeprom",
                           "eeprom_wear", "battery_v", "counting_error", "multi_turn_jump", "accel_rad_s2",
                           "motion", "speed_rpm", "fault", "power"}) {
    EXPECT_NE(bench.Value(name), "absent") << name;
  }
  bench.Set("eeprom", "72=A1 05");
  EXPECT_EQ(bench.Value("eeprom"), "72=A1 05");
  bench.Set("enid", "0x17");
  EXPECT_EQ(bench.Value("enid"), "23");
}

TEST(SimulatorTest, LookingChangesNothing) {
  DeviceFixture one("unpaced");
  DeviceFixture other("unpaced");
  for (DeviceFixture* bench : {&one, &other}) bench->Set("noise_counts", "100");
  for (int i = 0; i < 100; ++i) static_cast<void>(one.Value("alarms"));
  EXPECT_EQ(one.Ask({0x1A}), other.Ask({0x1A}));
}

}  // namespace

}  // namespace axlecast::tformat
