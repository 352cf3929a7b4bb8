// The line of simulated units in virtual time: framing, silence, the 0.1 s of guideline 3 in its readings, broadcast,
// wire time, faults.
#include "drivers/tsubaki_sc/simulator/bus_simulator.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <yaml-cpp/yaml.h>

#include <array>
#include <memory>

#include "core/config/config_map.h"
#include "core/config/machine_config.h"
#include "tests/support/golden_file.h"

namespace axlecast::tsubaki_sc::simulator {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;
using testing::SizeIs;
using ByteList = std::vector<std::uint8_t>;

// The keys of `timing`: README.md of this folder.
enum class Reading : std::uint8_t { kA, kL, kW, kNone };
struct LineRules {
  Reading reading = Reading::kA;
  bool paced = true;
  MonoNs reply_delay = 5 * kMillisecond;
  MonoNs tolerance = 2 * kMillisecond;
  bool echo = false;
};

constexpr MonoNs kStart = 5'000 * kSecond;
// 11 bits at 9600 bit/s, rounded down to ns for n characters.
MonoNs Wire(int characters) { return characters * 11 * kSecond / 9600; }

// Appends the error check; its own calculation is tested against printed frames.
ByteList Sealed(ByteList frame) {
  const std::uint16_t check = ErrorCheck(frame);
  frame.push_back(static_cast<std::uint8_t>(check));
  frame.push_back(static_cast<std::uint8_t>(check >> 8U));
  return frame;
}
ByteList Sealed(const std::string& hex) { return Sealed(GoldenBytes(hex)); }

struct Delivery {
  MonoNs at;
  ByteList bytes;
};

// Units 1, 2, ... named gm1, gm2, ... on a line in virtual time.
class DeviceFixture {
 public:
  explicit DeviceFixture(const LineRules& rules = {}, int units = 3) {
    constexpr std::array<const char*, 4> kReadings = {"A", "L", "W", "none"};
    const auto milliseconds = [](MonoNs time) { return std::to_string(static_cast<double>(time) / kMillisecond); };
    std::string yaml = "{timing: {reading: " + std::string(kReadings.at(static_cast<std::size_t>(rules.reading))) +
                       ", pace: " + (rules.paced ? "wire" : "unpaced") +
                       ", reply_delay_ms: " + milliseconds(rules.reply_delay) +
                       ", tolerance_ms: " + milliseconds(rules.tolerance) + "}";
    std::vector<std::pair<std::string, std::uint8_t>> names;
    for (int i = 1; i <= units; ++i) {
      names.emplace_back("gm" + std::to_string(i), static_cast<std::uint8_t>(i));
      yaml += ", " + names.back().first + ": {seed: 1}";
    }
    ConfigErrors errors("machine.yaml");
    ConfigMap map(YAML::Load(yaml + "}"), "simulate", errors);
    BusConfig bus;
    bus.link.echo = rules.echo;
    simulator_ = MakeSimulator(bus, map, names);
    EXPECT_EQ(errors.Text(), "");
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
  // What comes before another command may be sent.
  ByteList Ask(const std::string& hex) {
    deliveries_.clear();
    Send(Sealed(hex));
    Pass(300 * kMillisecond);
    return deliveries_.size() == 1 ? deliveries_[0].bytes : ByteList();
  }
  void Set(const std::string& device, const std::string& key, const std::string& value) {
    EXPECT_EQ(ErrorText(simulator_->Set(device, key, value, now_)), "");
  }
  std::string Value(const std::string& device, const std::string& key) {
    for (const auto& [name, value] : simulator_->State(device, now_)) {
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

constexpr const char* kReadStatus = "02 04 00 C8 00 05";  // of unit 2
constexpr const char* kReadLogin = "02 04 01 2C 00 01";
const std::string kLogInTail = " 10 00 64 00 08 10 70 61 73 73 77 6F 72 64 00 00 00 00 00 00 00 00";

// ---- wire time: device table "one read of 7 registers, 135.9 ms at reading A" ----

TEST(BusSimulatorTest, AResponseEndsWhenItsLastBitDoes) {
  DeviceFixture bench;
  bench.Send(Sealed("02 04 00 64 00 07"));
  bench.Pass(kSecond);
  ASSERT_THAT(bench.deliveries(), SizeIs(1));
  const MonoNs end = Wire(8) + 5 * kMillisecond + Wire(5 + 14);
  EXPECT_EQ(bench.deliveries()[0].at - kStart, end);
  EXPECT_NEAR(static_cast<double>(end + 100 * kMillisecond) * 1e-6, 135.9, 0.05);
  EXPECT_EQ(bench.deliveries()[0].bytes.size(), 19U);
  EXPECT_EQ(bench.deliveries()[0].bytes[0], 2);
}

// The table of times in ../README.md: every command goes out as soon as the reading allows, and all are answered.
TEST(BusSimulatorTest, TheTableOfTimes) {
  using Reads = std::vector<std::pair<unsigned, int>>;  // first address, registers
  const auto seconds = [](Reading reading, int units, const Reads& reads) {
    DeviceFixture bench(LineRules{.reading = reading, .tolerance = 0}, units);
    for (int unit = 1; unit <= units; ++unit) {
      for (const auto& [start, count] : reads) {
        bench.Send(Sealed(ByteList{static_cast<std::uint8_t>(unit), 0x04, static_cast<std::uint8_t>(start >> 8U),
                                   static_cast<std::uint8_t>(start), 0, static_cast<std::uint8_t>(count)}));
        const MonoNs end = Wire(8) + 5 * kMillisecond + Wire(5 + 2 * count);
        const MonoNs after_command = std::max(Wire(8) + 100 * kMillisecond, end + 5 * kMillisecond);
        bench.Pass(reading == Reading::kA ? end + 100 * kMillisecond : after_command);
      }
    }
    EXPECT_EQ(bench.deliveries().size(), static_cast<std::size_t>(units) * reads.size());
    return static_cast<double>(bench.now() - kStart) * 1e-9;
  };
  const Reads live = {{100, 7}, {200, 5}};
  Reads logs;
  for (unsigned log = 1000; log <= 3000; log += 1000) {
    for (unsigned quantity = 0; quantity <= 600; quantity += 100) logs.emplace_back(log + quantity, 20);
  }
  const Reads newest(logs.begin(), logs.begin() + 7);
  EXPECT_NEAR(seconds(Reading::kA, 1, {{100, 7}}), 0.1359, 5e-5);
  EXPECT_NEAR(seconds(Reading::kL, 1, {{100, 7}}), 0.1092, 5e-5);
  EXPECT_NEAR(seconds(Reading::kA, 1, live), 0.267, 5e-4);
  EXPECT_NEAR(seconds(Reading::kL, 1, live), 0.218, 5e-4);
  EXPECT_NEAR(seconds(Reading::kA, 16, live), 4.28, 5e-3);
  EXPECT_NEAR(seconds(Reading::kL, 16, live), 3.49, 5e-3);
  EXPECT_NEAR(seconds(Reading::kA, 1, newest), 1.16, 5e-3);
  EXPECT_NEAR(seconds(Reading::kL, 1, newest), 0.764, 5e-4);
  EXPECT_NEAR(seconds(Reading::kA, 1, logs), 3.48, 5e-3);
  EXPECT_NEAR(seconds(Reading::kL, 1, logs), 2.29, 5e-3);
}

TEST(BusSimulatorTest, ReplyDelayAndUnpaced) {
  DeviceFixture slow(LineRules{.reply_delay = 20 * kMillisecond});
  slow.Send(Sealed(kReadStatus));
  slow.Pass(kSecond);
  ASSERT_THAT(slow.deliveries(), SizeIs(1));
  EXPECT_EQ(slow.deliveries()[0].at - kStart, Wire(8) + 20 * kMillisecond + Wire(15));
  DeviceFixture unpaced(LineRules{.reading = Reading::kNone, .paced = false});
  for (int i = 0; i < 3; ++i) unpaced.Send(Sealed(kReadStatus));
  EXPECT_THAT(unpaced.deliveries(), SizeIs(3));
  EXPECT_EQ(unpaced.now(), kStart);
}

// ---- the 0.1 s of guideline 3 ----

// Sends two reads, the second `after` the end of the first command or response, and counts responses.
std::size_t Pair(const LineRules& rules, const std::string& first, const std::string& second,
                 MonoNs command_to_command) {
  DeviceFixture bench(rules);
  bench.Send(Sealed(first));
  bench.Pass(command_to_command);
  bench.Send(Sealed(second));
  bench.Pass(kSecond);
  return bench.deliveries().size();
}

TEST(BusSimulatorTest, ReadingACountsFromTheEndOfTheResponseOnTheWholeBus) {
  const LineRules rules{.reading = Reading::kA};
  const MonoNs pause = Wire(8) + 5 * kMillisecond + Wire(15) + 100 * kMillisecond;
  for (const char* second : {kReadStatus, "01 04 00 C8 00 05"}) {
    EXPECT_EQ(Pair(rules, kReadStatus, second, pause - 1), 1U);
    EXPECT_EQ(Pair(rules, kReadStatus, second, pause), 2U);
  }
}

TEST(BusSimulatorTest, ReadingLCountsFromTheEndOfTheCommand) {
  const LineRules rules{.reading = Reading::kL, .tolerance = 0};
  const MonoNs pause = Wire(8) + 100 * kMillisecond;
  for (const char* second : {kReadStatus, "01 04 00 C8 00 05"}) {
    EXPECT_EQ(Pair(rules, kReadStatus, second, pause - 1), 1U);
    EXPECT_EQ(Pair(rules, kReadStatus, second, pause), 2U);
  }
  EXPECT_EQ(Pair({.reading = Reading::kL}, kReadStatus, kReadStatus, pause - 2 * kMillisecond), 2U);
}

TEST(BusSimulatorTest, ReadingWCountsForEachUnit) {
  const LineRules rules{.reading = Reading::kW};
  const MonoNs response = Wire(8) + 5 * kMillisecond + Wire(15);
  EXPECT_EQ(Pair(rules, kReadStatus, kReadStatus, response + 100 * kMillisecond - 1), 1U);
  EXPECT_EQ(Pair(rules, kReadStatus, kReadStatus, response + 100 * kMillisecond), 2U);
  EXPECT_EQ(Pair(rules, kReadStatus, "01 04 00 C8 00 05", response + 5 * kMillisecond), 2U);
  EXPECT_EQ(Pair(rules, kReadStatus, "01 04 00 C8 00 05", response + 5 * kMillisecond - 1), 1U) << "no silence";
}

class EarlyCommand : public testing::TestWithParam<Reading> {};

TEST_P(EarlyCommand, IsDroppedCountedAndNotCarriedOut) {
  DeviceFixture bench(LineRules{.reading = GetParam()});
  bench.Ask("02" + kLogInTail);
  bench.Send(Sealed(kReadStatus));
  bench.Pass(60 * kMillisecond);
  bench.Send(Sealed("02 05 00 64 FF 00"));  // stop
  bench.Pass(80 * kMillisecond);
  bench.Send(Sealed("02 05 00 64 FF 00"));  // too early after the one that was dropped
  bench.Pass(kSecond);
  EXPECT_EQ(bench.Value("gm2", "dropped_early"), "2");
  EXPECT_EQ(bench.Value("gm1", "dropped_early"), "0");
  EXPECT_EQ(bench.Value("gm2", "motor"), "running");
  EXPECT_EQ(bench.Value("gm2", "responses"), "2");
  EXPECT_THAT(bench.Ask("02 05 00 64 FF 00"), SizeIs(8));
  EXPECT_EQ(bench.Value("gm2", "motor"), "stopped");
}

INSTANTIATE_TEST_SUITE_P(Readings, EarlyCommand, testing::Values(Reading::kA, Reading::kL, Reading::kW),
                         [](const auto& reading) {
                           return std::string(1, "ALW"[static_cast<int>(reading.param)]);
                         });

TEST(BusSimulatorTest, WithoutTheRuleOnlySilenceIsAskedFor) {
  const LineRules rules{.reading = Reading::kNone};
  const MonoNs response = Wire(8) + 5 * kMillisecond + Wire(15);
  EXPECT_EQ(Pair(rules, kReadStatus, kReadStatus, response + 5 * kMillisecond), 2U);
  EXPECT_EQ(Pair(rules, kReadStatus, kReadStatus, response + 5 * kMillisecond - 1), 1U);
}

// ---- frames: guideline 4, "No response" ----

TEST(BusSimulatorTest, AGapOf5MillisecondsInsideACommandDropsIt) {
  for (const auto& [gap, answers] :
       {std::pair<MonoNs, std::size_t>(5 * kMillisecond - 1, 1), {5 * kMillisecond, 0}}) {
    DeviceFixture bench;
    const ByteList command = Sealed(kReadStatus);
    bench.Send({command.begin(), command.begin() + 3});
    bench.Pass(Wire(3) + gap);
    bench.Send({command.begin() + 3, command.end()});
    bench.Pass(kSecond);
    EXPECT_THAT(bench.deliveries(), SizeIs(answers)) << gap;
    EXPECT_EQ(bench.Value("gm1", "bus_dropped_gap"), answers == 0 ? "1" : "0");
    EXPECT_THAT(bench.Ask(kReadStatus), SizeIs(15)) << "the next one is received";
  }
}

TEST(BusSimulatorTest, ACommandInPiecesIsOne) {
  DeviceFixture bench;
  for (const std::uint8_t byte : Sealed(kReadStatus)) {
    bench.Send({byte});
    bench.Pass(3 * kMillisecond);
  }
  bench.Pass(kSecond);
  EXPECT_THAT(bench.deliveries(), SizeIs(1));
}

TEST(BusSimulatorTest, AWrongErrorCheckIsNotAnswered) {
  DeviceFixture bench;
  ByteList command = Sealed(kReadStatus);
  for (std::size_t i = 0; i < command.size(); ++i) {
    command[i] ^= 0x40U;
    bench.Send(command);
    bench.Pass(kSecond);
    command[i] ^= 0x40U;
  }
  EXPECT_THAT(bench.deliveries(), IsEmpty());
  EXPECT_EQ(bench.Value("gm1", "bus_dropped_checksum"), "8");
  EXPECT_EQ(bench.Value("gm2", "bus_dropped_checksum"), "8");
}

TEST(BusSimulatorTest, TwoCommandsWithoutSilenceAreNone) {
  DeviceFixture bench;
  ByteList both = Sealed(kReadStatus);
  const ByteList second = Sealed("01 04 00 C8 00 05");
  both.insert(both.end(), second.begin(), second.end());
  bench.Send(both);
  bench.Pass(kSecond);
  EXPECT_THAT(bench.deliveries(), IsEmpty());
  EXPECT_EQ(bench.Value("gm1", "bus_dropped_silence"), "1");
}

TEST(BusSimulatorTest, AForeignAddressIsNotAnswered) {
  DeviceFixture bench;
  for (const char* address : {"04", "10", "11", "80", "FF"}) {
    EXPECT_THAT(bench.Ask(std::string(address) + " 04 00 C8 00 05"), IsEmpty());
  }
  EXPECT_EQ(bench.Value("gm1", "bus_foreign"), "5");
}

TEST(BusSimulatorTest, GarbageIsCountedAndForgotten) {
  DeviceFixture bench;
  SeededRandom random(3);
  for (int i = 0; i < 2000; ++i) {
    ByteList bytes(random.Next() % 400);
    for (std::uint8_t& byte : bytes) byte = static_cast<std::uint8_t>(random.Next());
    bench.Send(bytes);
    bench.Pass(static_cast<MonoNs>(random.Next() % 600) * kMillisecond);
  }
  bench.Pass(100 * kSecond);  // what is still on the wire
  EXPECT_THAT(bench.deliveries(), IsEmpty());
  EXPECT_THAT(bench.Ask(kReadStatus), SizeIs(15));
}

TEST(BusSimulatorTest, AnotherBaudRateIsNoise) {
  DeviceFixture bench;
  bench.simulator().OnBaud(19'200);
  EXPECT_THAT(bench.Ask(kReadStatus), IsEmpty());
  EXPECT_EQ(bench.Value("gm1", "bus_dropped_baud"), "1");
  bench.simulator().OnBaud(9'600);
  EXPECT_THAT(bench.Ask(kReadStatus), SizeIs(15));
}

TEST(BusSimulatorTest, WhoTransmitsIntoAResponseDestroysBoth) {
  DeviceFixture bench(LineRules{.reading = Reading::kNone});
  bench.Send(Sealed(kReadStatus));
  bench.Pass(Wire(8) + 10 * kMillisecond);
  bench.Send(Sealed("01 04 00 C8 00 05"));
  bench.Pass(kSecond);
  EXPECT_THAT(bench.deliveries(), IsEmpty());
  EXPECT_EQ(bench.Value("gm1", "bus_collisions"), "1");
}

// ---- broadcast: guideline 4 and 6 note 2 ----

TEST(BusSimulatorTest, ABroadcastIsCarriedOutByAllAndAnsweredByNone) {
  DeviceFixture bench;
  EXPECT_THAT(bench.Ask("00" + kLogInTail), IsEmpty());
  EXPECT_THAT(bench.Ask("00 06 00 34 04 21"), IsEmpty());
  EXPECT_THAT(bench.Ask("00 10 00 35 00 02 04 10 0B 00 0C"), IsEmpty());
  EXPECT_THAT(bench.Ask("00 0F 00 64 00 01 01 01"), IsEmpty());
  EXPECT_THAT(bench.Ask("00 05 00 00 FF 00"), IsEmpty());
  EXPECT_THAT(bench.Ask("00 04 00 C8 00 05"), IsEmpty()) << "nothing to process";
  for (const char* unit : {"01", "02", "03"}) {
    EXPECT_THAT(bench.Ask(unit + std::string(" 04 01 2C 00 01"))[3], 0xFF);
    const ByteList limits = bench.Ask(unit + std::string(" 03 00 34 00 03"));
    ASSERT_THAT(limits, SizeIs(11));
    EXPECT_THAT(ByteList(limits.begin() + 3, limits.begin() + 9), ElementsAre(4, 0x21, 0x10, 0x0B, 0, 0x0C));
  }
  EXPECT_EQ(bench.Value("gm1", "motor"), "stopped");
  EXPECT_EQ(bench.Value("gm2", "trip_count_clears"), "1");
  EXPECT_EQ(bench.Value("gm3", "broadcasts"), "5");
}

// ---- power ----

TEST(BusSimulatorTest, PowerOffIsSilentAndLogsOut) {
  DeviceFixture bench;
  bench.Ask("02" + kLogInTail);
  EXPECT_EQ(bench.Ask(kReadLogin)[3], 0xFF);
  bench.Set("gm2", "power", "off");
  EXPECT_THAT(bench.Ask(kReadLogin), IsEmpty());
  EXPECT_EQ(bench.Value("gm2", "unanswered"), "1");
  bench.Set("gm2", "power", "on");
  EXPECT_EQ(bench.Ask(kReadLogin)[3], 0x00);
  bench.Ask("02" + kLogInTail);
  bench.Set("gm2", "power", "cycle");
  EXPECT_EQ(bench.Ask(kReadLogin)[3], 0x00);
  EXPECT_EQ(bench.Value("gm2", "logins"), "2");
}

// ---- faults ----

TEST(BusSimulatorTest, FaultsOfTheLine) {
  DeviceFixture bench;
  const ByteList right = bench.Ask(kReadStatus);
  bench.Set("gm2", "fault", "garbage");
  const ByteList garbage = bench.Ask(kReadStatus);
  EXPECT_THAT(garbage, SizeIs(15));
  EXPECT_NE(garbage, right);
  bench.Set("gm2", "fault", "bit_flip:0.05");
  EXPECT_NE(bench.Ask(kReadStatus), right);
  bench.Set("gm2", "fault", "short");
  EXPECT_LT(bench.Ask(kReadStatus).size(), 15U);
  bench.Set("gm2", "fault", "off");
  EXPECT_THAT(bench.Ask(kReadStatus), IsEmpty());
  EXPECT_THAT(bench.Ask("01 04 00 C8 00 05"), SizeIs(15)) << "the others continue";
  bench.Set("gm2", "fault", "intermittent:1");
  EXPECT_THAT(bench.Ask(kReadStatus), IsEmpty());
  bench.Set("gm2", "fault", "request_flip:0.2");  // some without a wrong stop bit
  for (int i = 0; i < 20; ++i) EXPECT_THAT(bench.Ask(kReadStatus), IsEmpty());
  EXPECT_EQ(bench.Value("gm2", "dropped_line"), "20");
  bench.Set("gm2", "fault", "none");
  EXPECT_EQ(bench.Ask(kReadStatus), right);
  bench.Set("gm2", "fault", "echo");
  bench.Ask("01 04 00 C8 00 05");
  EXPECT_THAT(bench.deliveries(), SizeIs(2));
}

TEST(BusSimulatorTest, ADelayedResponseLeavesTheLineInTimeASlowOneDoesNot) {
  DeviceFixture bench;
  bench.Set("gm2", "fault", "delayed:400");
  bench.Send(Sealed(kReadStatus));
  bench.Pass(300 * kMillisecond);
  bench.Send(Sealed("01 04 01 2C 00 01"));
  bench.Pass(kSecond);
  ASSERT_THAT(bench.deliveries(), SizeIs(2));
  EXPECT_EQ(bench.deliveries()[0].bytes[0], 1);
  EXPECT_EQ(bench.deliveries()[1].bytes[0], 2) << "late: must not become another unit's";

  bench.deliveries().clear();
  bench.Set("gm2", "fault", "slow:290000");
  bench.Send(Sealed(kReadStatus));
  bench.Pass(300 * kMillisecond);
  bench.Send(Sealed("01 04 01 2C 00 01"));
  bench.Pass(kSecond);
  EXPECT_THAT(bench.deliveries(), IsEmpty());
  EXPECT_EQ(bench.Value("gm1", "bus_collisions"), "1");
}

TEST(BusSimulatorTest, FaultsOfModbus) {
  DeviceFixture bench;
  bench.Set("gm2", "fault", "wrong-address:3");
  EXPECT_EQ(bench.Ask(kReadStatus)[0], 3);
  bench.Set("gm2", "fault", "exception:2");
  EXPECT_EQ(bench.Ask(kReadStatus), Sealed("02 84 02"));
  bench.Set("gm2", "fault", "exception");
  EXPECT_EQ(bench.Ask(kReadStatus), Sealed("02 84 04"));
  EXPECT_EQ(bench.Value("gm2", "fault"), "exception:4");
  EXPECT_EQ(bench.Value("gm2", "errors_02"), "1");
  EXPECT_EQ(bench.Value("gm2", "errors_04"), "1");
  EXPECT_THAT(ErrorText(bench.simulator().Set("gm2", "fault", "rust", bench.now())),
              HasSubstr("wrong_address, exception"));
  EXPECT_THAT(ErrorText(bench.simulator().Set("gm2", "fault", "exception:0", bench.now())),
              HasSubstr("from 1 to 255"));
}

TEST(BusSimulatorTest, WhoeverLooksOnChangesNothing) {
  DeviceFixture bench;
  bench.Set("gm1", "vibration_mps2", "5");
  bench.Pass(kSecond);
  EXPECT_EQ(bench.simulator().State("gm1", bench.now() + kSecond),
            bench.simulator().State("gm1", bench.now() + kSecond));
  EXPECT_THAT(bench.simulator().State("gm9", bench.now()), IsEmpty());
  EXPECT_THAT(ErrorText(bench.simulator().Set("gm9", "load_w", "1", bench.now())), HasSubstr("gm1, gm2, gm3"));
  EXPECT_THAT(ErrorText(bench.simulator().Set("gm1", "load", "1", bench.now())), HasSubstr("load_w"));
}

TEST(BusSimulatorTest, NoPasswordIsShown) {
  DeviceFixture bench;
  bench.Set("gm1", "password", "s3cret-and-long");
  EXPECT_THAT(ErrorText(bench.simulator().Set("gm1", "password", "tiny7!!", bench.now())), Not(HasSubstr("tiny7")));
  EXPECT_THAT(ErrorText(bench.simulator().Set("gm1", "password", "far-too-long-for-it", bench.now())),
              Not(HasSubstr("far")));
  for (const auto& [name, value] : bench.simulator().State("gm1", bench.now())) {
    EXPECT_NE(name, "password");
    EXPECT_THAT(value, Not(HasSubstr("s3cret"))) << name;
  }
  EXPECT_THAT(bench.Ask("01" + kLogInTail), SizeIs(5)) << "the delivered one does not hold any more";
  EXPECT_EQ(bench.Value("gm1", "wrong_passwords"), "1");
}

TEST(BusSimulatorTest, SixteenUnitsAnswerEachForItself) {
  DeviceFixture bench({}, 16);
  bench.Pass(kSecond);  // they have run up
  for (int i = 1; i <= 16; ++i) bench.Set("gm" + std::to_string(i), "load_w", std::to_string(100 + i));
  for (int i = 1; i <= 16; ++i) {
    bench.deliveries().clear();
    bench.Send(Sealed(ByteList{static_cast<std::uint8_t>(i), 0x04, 0, 102, 0, 1}));
    bench.Pass(150 * kMillisecond);
    ASSERT_THAT(bench.deliveries(), SizeIs(1)) << i;
    const ByteList& reply = bench.deliveries()[0].bytes;
    EXPECT_EQ(reply[0], i);
    EXPECT_EQ(reply[3] * 256 + reply[4], 10 * (100 + i));
  }
}

}  // namespace
}  // namespace axlecast::tsubaki_sc::simulator
