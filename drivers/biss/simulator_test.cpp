// The simulator against the manual: what it puts on its line at which edge, and of what it complains.
#include "drivers/biss/family.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "drivers/biss/bits_test_support.h"
#include "drivers/biss/machine_test_support.h"

namespace axlecast::biss {
namespace {

using ::testing::HasSubstr;
using ::testing::StartsWith;

constexpr MonoNs kStart = 100 * kSecond;
constexpr int kFalling = 2;
constexpr int kRising = 3;

class BissSimulatorTest : public ::testing::Test {
 protected:
  std::string Make(const std::string& keys, const std::string& simulate) {
    machine_ = LoadMachine("", keys);
    ConfigErrors errors("machine.yaml");
    ConfigMap map(YAML::Load("{a: {" + simulate + "}}"), "simulate", errors);
    simulator_ = MakeBissSimulator(machine_.buses.at(0), map);
    map.Done();
    if (simulator_) simulator_->OnDue(kStart, [](Bytes) {});
    return errors.Text();
  }
  // What the controller clocks in, in bits; the clock's first edge is at `at`.
  std::string Clock(std::size_t bytes, MonoNs at, int mode = kFalling, std::int64_t hz = 1'000'000, int word = 8) {
    std::vector<std::uint8_t> tx(bytes);
    std::vector<std::uint8_t> rx(bytes, 0xA5);
    simulator_->OnTransfer({.settings = {.mode = mode, .clock_hz = hz}, .bits_per_word = word, .tx = tx}, at, rx);
    now_ = at;
    std::string text;
    for (const std::uint8_t byte : rx) text += TextOf(byte, 8);
    return text;
  }
  std::string Value(const std::string& key) {
    for (const auto& [name, value] : simulator_->State("a", now_)) {
      if (name == key) return value;
    }
    return "absent";
  }
  void Set(const std::string& key, const std::string& value) {
    ASSERT_EQ(ErrorText(simulator_->Set("a", key, value, now_)), "") << key;
  }

  MachineConfig machine_;
  std::unique_ptr<Simulator> simulator_;
  MonoNs now_ = kStart;
};

const std::string kExample = "bits: 16";
const std::string kThere = "start_deg: 195.3095, warning: on";
const std::string kFrame =
    "1000101011100011"
    "10"
    "001010";

// 5.6, sentence by sentence: idle high; the second rising edge pulls the line low; two clocks of Tbusy; start bit, fixed
// 0; the manual's frame; low until the time-out.
TEST_F(BissSimulatorTest, SendsTheManualsFrame) {
  ASSERT_EQ(Make(kExample, kThere), "");
  EXPECT_EQ(Clock(5, kStart),
            "11"
            "00"
            "10" +
                kFrame + "0000000000");
  EXPECT_EQ(Value("frames"), "1");
  EXPECT_EQ(Clock(5, kStart + kMillisecond, kRising),
            "11"
            "00"
            "10" +
                kFrame + "0000000000")
      << "on the rising edges it is what the edge before has made";
}

TEST_F(BissSimulatorTest, TheLinesDelayMovesTheSamples) {
  ASSERT_EQ(Make(kExample, kThere), "");
  Set("line_delay_ns", "480");
  EXPECT_THAT(Clock(5, kStart), StartsWith("110010" + kFrame));
  Set("line_delay_ns", "520");
  EXPECT_THAT(Clock(5, kStart + kMillisecond), StartsWith("1110010" + kFrame));
  EXPECT_THAT(Clock(5, kStart + 2 * kMillisecond, kRising), StartsWith("110010" + kFrame));
  Set("line_delay_ns", "3100");
  EXPECT_THAT(Clock(5, kStart + 3 * kMillisecond), StartsWith("111110010" + kFrame));
}

// "Digital driver maximum slew rate: 10 ns".
TEST_F(BissSimulatorTest, NearAChangeEitherLevelIsRead) {
  ASSERT_EQ(Make(kExample, "line_delay_ns: 505"), "");
  std::string one = Clock(5, kStart);
  bool differs = false;
  for (int i = 1; i < 20; ++i) differs = Clock(5, kStart + i * kMillisecond) != one || differs;
  EXPECT_TRUE(differs);
  EXPECT_NE(Value("near_edges"), "0");
}

TEST_F(BissSimulatorTest, TheStartBitWaitsForTheEncoder) {
  ASSERT_EQ(Make(kExample, kThere), "");
  Set("busy_clocks", "5");
  EXPECT_THAT(Clock(5, kStart), StartsWith("11"
                                           "00000"
                                           "10" +
                                           kFrame));
  Set("busy_us", "10.5");  // latched at 0.5 us, so the edge at 11.5 us brings it
  EXPECT_THAT(Clock(6, kStart + kMillisecond), StartsWith("11"
                                                          "0000000000"
                                                          "10" +
                                                          kFrame));
  Set("busy_us", "100");
  EXPECT_EQ(Clock(5, kStart + 2 * kMillisecond), "11" + std::string(38, '0'));
  EXPECT_EQ(Value("cut"), "1");
}

// "The first rising edge of MA+ latches the sensor status".
TEST_F(BissSimulatorTest, TheFirstRisingEdgeLatches) {
  ASSERT_EQ(Make("bits: 26", "speed_rpm: 3000, accel_rad_s2: 200000"), "");
  const MonoNs at = kStart + kSecond;
  const std::string text = Clock(6, at, kFalling, 100'000);
  const std::uint64_t sent = std::stoull(text.substr(6, 26), nullptr, 2);
  simulator_->OnDue(at + 5 * kMicrosecond, [](Bytes) {});
  now_ = at + 5 * kMicrosecond;
  EXPECT_EQ(std::to_string(sent), Value("single_turn")) << "half a cycle after the first falling edge";
}

TEST_F(BissSimulatorTest, ErrorAndWarningAreActiveLow) {
  ASSERT_EQ(Make(kExample, "start_deg: 0"), "");
  EXPECT_EQ(Clock(4, kStart).substr(22, 2), "11");
  Set("error", "on");
  EXPECT_EQ(Clock(4, kStart + kMillisecond).substr(22, 2), "01");
  Set("warning", "on");
  EXPECT_EQ(Clock(4, kStart + 2 * kMillisecond).substr(22, 2), "00");
}

TEST_F(BissSimulatorTest, TurnsAndAnotherCheck) {
  ASSERT_EQ(Make("bits: 12, turn_bits: 4, crc: {bits: 8, poly: 0x11D, start: 0xFF, inverted: false}",
                 "start_turns: 9, start_deg: 90"),
            "");
  const std::string covered =
      "1001"
      "010000000000"
      "11";
  EXPECT_THAT(Clock(5, kStart), StartsWith("110010" + covered + NaiveCrc(covered, 0x11D, 8, 0xFF, false)));
}

TEST_F(BissSimulatorTest, ComplainsOfAClockThatItCannotFollow) {
  ASSERT_EQ(Make(kExample, kThere), "");
  const std::string nothing(40, '1');
  EXPECT_EQ(Clock(5, kStart, 0), nothing);
  EXPECT_EQ(Clock(5, kStart + kMillisecond, 1), nothing);
  EXPECT_EQ(Value("wrong_mode"), "2") << "idle state: the clock stays high";
  EXPECT_EQ(Clock(5, kStart + 2 * kMillisecond, kFalling, 10'000'000), nothing);
  EXPECT_EQ(Value("fast_clock"), "1") << "TMAS > 100 ns";
  EXPECT_THAT(Clock(5, kStart + 3 * kMillisecond, kFalling, 9'999'999), StartsWith("11"));
  EXPECT_EQ(Value("fast_clock"), "1");
  EXPECT_EQ(Clock(5, kStart + 4 * kMillisecond, kFalling, 1'000'000, 16), nothing);
  EXPECT_EQ(Value("wrong_words"), "1");
}

// "Timeout: BISS timeout time = 16 us".
TEST_F(BissSimulatorTest, TheTimeOutEndsAFrame) {
  ASSERT_EQ(Make(kExample, kThere), "");
  Clock(5, kStart);
  const MonoNs last_edge = kStart + 39'500;
  EXPECT_EQ(Clock(5, last_edge + 15'999), std::string(40, '0')) << "it is in the frame before, and low";
  EXPECT_EQ(Value("early"), "1");
  const MonoNs again = last_edge + 15'999 + 39'500;
  EXPECT_THAT(Clock(5, again + 16'000 + 80), StartsWith("110010" + kFrame));
  EXPECT_EQ(Value("early"), "1");
}

TEST_F(BissSimulatorTest, AClockThatRestsBreaksTheFrame) {
  ASSERT_EQ(Make(kExample, kThere), "");
  EXPECT_THAT(Clock(5, kStart, kFalling, 30'000), StartsWith("1111")) << "each edge latches again";
  EXPECT_NE(Value("slow_clock"), "0");
  Set("byte_gap_us", "15");
  EXPECT_THAT(Clock(5, kStart + 10 * kMillisecond), StartsWith("110010" + kFrame)) << "the controller's pauses";
  Set("byte_gap_us", "16");
  EXPECT_THAT(Clock(5, kStart + 20 * kMillisecond), ::testing::Not(HasSubstr(kFrame)));
}

TEST_F(BissSimulatorTest, ATransferThatIsTooShortIsCut) {
  ASSERT_EQ(Make(kExample, kThere), "");
  Clock(3, kStart);
  EXPECT_EQ(Value("cut"), "1");
  EXPECT_THAT(Clock(5, kStart + kMillisecond), StartsWith("110010" + kFrame)) << "the next one is whole";
  EXPECT_EQ(Value("slow_clock"), "0");
}

TEST_F(BissSimulatorTest, EachFaultDoesWhatItsNameSays) {
  ASSERT_EQ(Make(kExample, kThere), "");
  MonoNs at = kStart;
  const auto heard = [&](const std::string& key, const std::string& value) {
    Set(key, value);
    return Clock(5, at += kMillisecond);
  };
  const std::string good = "110010" + kFrame + "0000000000";
  EXPECT_EQ(heard("fault", "off"), std::string(40, '1'));
  EXPECT_EQ(heard("fault", "intermittent:1"), std::string(40, '1'));
  EXPECT_EQ(Value("unanswered"), "2");
  EXPECT_NE(heard("fault", "garbage"), good);
  EXPECT_NE(heard("fault", "bit_flip:0.2"), good);
  EXPECT_THAT(heard("fault", "short"), ::testing::EndsWith("11111111"));
  EXPECT_THAT(heard("fault", "slow:8"), StartsWith("11"
                                                   "0000000"
                                                   "10"));
  EXPECT_EQ(heard("fault", "none"), good);
  EXPECT_EQ(heard("wiring", "open"), std::string(40, '1'));
  EXPECT_EQ(heard("wiring", "shorted"), std::string(40, '0'));
  EXPECT_THAT(heard("wiring", "swapped"), StartsWith("001101"));
  Set("wiring", "good");
  EXPECT_EQ(heard("cds", "on").substr(4, 2), "11");
  Set("cds", "off");
  EXPECT_EQ(heard("power", "off"), std::string(40, '1'));
  EXPECT_EQ(heard("power", "on"), good);
  Set("fault", "stuck");
  EXPECT_EQ(heard("speed_rpm", "3000"), good);
  EXPECT_NE(heard("fault", "none"), good);
}

TEST_F(BissSimulatorTest, NamesWhatItCannotSet) {
  ASSERT_EQ(Make(kExample, ""), "");
  EXPECT_THAT(ErrorText(simulator_->Set("a", "fault", "echo", kStart)), HasSubstr("has no meaning here"));
  EXPECT_THAT(ErrorText(simulator_->Set("a", "wiring", "loose", kStart)),
              HasSubstr("good, open, shorted, swapped"));
  EXPECT_THAT(ErrorText(simulator_->Set("a", "error", "1", kStart)), HasSubstr("one of off, on"));
  EXPECT_THAT(ErrorText(simulator_->Set("b", "error", "on", kStart)), HasSubstr("no simulated device"));
  EXPECT_THAT(Make(kExample, "start_turns: 1"), HasSubstr("unknown key 'start_turns'"));
  EXPECT_THAT(Make(kExample, "busy_clocks: 0"), HasSubstr("1 to 1000"));
}

TEST_F(BissSimulatorTest, FollowsAScript) {
  ASSERT_EQ(Make(kExample, "script: [{at_s: 1, error: on}]"), "");
  EXPECT_EQ(simulator_->NextDue(), kStart + kSecond);
  EXPECT_EQ(Clock(4, kStart + kSecond).substr(22, 2), "01");
}

}  // namespace
}  // namespace axlecast::biss
