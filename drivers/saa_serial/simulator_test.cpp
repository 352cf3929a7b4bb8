// The simulator against the manual: what it answers, when, and what it drops.
#include "drivers/saa_serial/family.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "core/config/config_map.h"
#include "drivers/saa_serial/machine_test_support.h"
#include "tests/support/golden_file.h"

namespace axlecast::saa_serial {
namespace {

using ::testing::HasSubstr;
using ::testing::IsEmpty;

constexpr MonoNs kStart = 100 * kSecond;
const std::string kLink = "simulate: true, link: {baud: 10000}";  // a character takes 1 ms
const std::string kHandshake = kLink + ", mode: handshake, lines: {clk: {}, clr: {}}";
const std::string kBus = kLink + ", mode: bus, zero_clearing: true";
const std::string kTiming = kLink + ", mode: timing, refresh_hz: 50, lines: {clr: {}}";
const std::string kDevices = "a: {bits: 14, address: 1}, b: {bits: 20, address: 2}";

class SaaSimulatorTest : public ::testing::Test {
 protected:
  std::string Make(const std::string& keys, const std::string& devices, const std::string& simulate) {
    machine_ = LoadMachine(keys, devices);
    ConfigErrors errors("machine.yaml");
    ConfigMap map(YAML::Load(simulate), "simulate", errors);
    simulator_ = MakeSaaSimulator(machine_.buses.at(0), map);
    map.Done();
    if (simulator_) RunUntil(kStart);
    return errors.Text();
  }
  void RunUntil(MonoNs until) {
    while (simulator_->NextDue() <= until) Due(std::max(simulator_->NextDue(), kStart));
    Due(until);
  }
  void Due(MonoNs at) {
    now_ = at;
    simulator_->OnDue(at, Transmit());
  }
  void Send(const std::string& hex, MonoNs at) {
    now_ = at;
    simulator_->OnBytes(GoldenBytes(hex), at, Transmit());
  }
  void Pulse(std::uint8_t line, MonoNs low, MonoNs end) {
    now_ = end;
    simulator_->OnPulse(line, low, end, Transmit());
  }
  Simulator::Transmit Transmit() {
    return
        [this](Bytes bytes) { heard_.emplace_back(now_, std::vector<std::uint8_t>(bytes.begin(), bytes.end())); };
  }
  std::string Value(const std::string& key, const std::string& device = "a") {
    for (const auto& [name, value] : simulator_->State(device, now_)) {
      if (name == key) return value;
    }
    return "absent";
  }

  MachineConfig machine_;
  std::unique_ptr<Simulator> simulator_;
  MonoNs now_ = 0;
  std::vector<std::pair<MonoNs, std::vector<std::uint8_t>>> heard_;
};

using SaaSimulatorBus = SaaSimulatorTest;
using SaaSimulatorLines = SaaSimulatorTest;

TEST_F(SaaSimulatorBus, AnswersWhenRequestT3AndFrameAreOver) {
  ASSERT_EQ(Make(kBus, kDevices, "{a: {start_deg: 8.416, processing_us: 500}}"), "");
  Send("BC AA B1", kStart);
  RunUntil(kStart + kSecond);
  ASSERT_EQ(heard_.size(), 1U);
  EXPECT_EQ(heard_[0].first, kStart + 8'500 * kMicrosecond) << "3 + 0.5 + 5 ms";
  EXPECT_EQ(heard_[0].second, GoldenBytes("FF 81 01 7F 00")) << "the manual's example";
}

TEST_F(SaaSimulatorBus, MaySayItsAddress) {
  ASSERT_EQ(Make(kBus, kDevices, "{a: {start_deg: 8.416, reply_header: address}}"), "");
  Send("BC AA B1", kStart);
  RunUntil(kStart + kSecond);
  EXPECT_EQ(heard_.at(0).second, GoldenBytes("FF B1 01 7F 30"));
}

TEST_F(SaaSimulatorBus, WhatIsNoCommandOfAnyEncoderIsDropped) {
  ASSERT_EQ(Make(kBus, kDevices, "{}"), "");
  Send("BC AA B7", kStart);
  Send("00 BC AB B1", kStart + 100 * kMillisecond);
  Send("BC BC AA B1", kStart + 200 * kMillisecond);
  RunUntil(kStart + kSecond);
  EXPECT_EQ(heard_.size(), 1U) << "the last one, after its false start";
  EXPECT_EQ(Value("unknown"), "5");
}

TEST_F(SaaSimulatorBus, TwoTransmittersDestroyBoth) {
  ASSERT_EQ(Make(kBus, kDevices, "{}"), "");
  Send("BC AA B1", kStart);
  Send("BC AA B2", kStart + 4 * kMillisecond);
  RunUntil(kStart + kSecond);
  EXPECT_THAT(heard_, IsEmpty());
  EXPECT_EQ(Value("collisions"), "3");
}

TEST_F(SaaSimulatorBus, ZeroActsOnItsEncoderAndIsNotAnswered) {
  ASSERT_EQ(Make(kBus, kDevices, "{a: {start_deg: 90}, b: {start_deg: 90}}"), "");
  Send("BC AA C1", kStart);
  RunUntil(kStart + kSecond);
  EXPECT_THAT(heard_, IsEmpty());
  EXPECT_EQ(Value("single_turn"), "0");
  EXPECT_EQ(Value("single_turn", "b"), "262144");
  EXPECT_EQ(Value("zeroings", "b"), "0");
}

TEST_F(SaaSimulatorBus, EachFaultDoesWhatItsNameSays) {
  ASSERT_EQ(Make(kBus, "a: {bits: 14, address: 1}", "{a: {start_deg: 8.416}}"), "");
  MonoNs at = kStart;
  const auto ask = [&](const std::string& fault) {
    EXPECT_EQ(ErrorText(simulator_->Set("a", "fault", fault, at)), "");
    heard_.clear();
    Send("BC AA B1", at);
    RunUntil(at + 900 * kMillisecond);
    at += kSecond;
    return heard_;
  };
  const auto good = GoldenBytes("FF 81 01 7F 00");
  const MonoNs usual = ask("none").at(0).first - kStart;
  EXPECT_THAT(ask("off"), IsEmpty());
  EXPECT_NE(ask("garbage").at(0).second, good);
  EXPECT_NE(ask("bit_flip:0.5").at(0).second, good);
  EXPECT_LT(ask("short").at(0).second.size(), 5U);
  EXPECT_EQ(ask("slow:5000").at(0).first - (at - kSecond), usual + 5 * kMillisecond);
  EXPECT_EQ(ask("delayed:30").at(0).first - (at - kSecond), usual + 30 * kMillisecond);
  EXPECT_THAT(ask("intermittent:1"), IsEmpty());
  EXPECT_EQ(ask("echo").at(0).second, GoldenBytes("BC AA B1"));
  EXPECT_THAT(ask("request_flip:0.5"), IsEmpty());
}

TEST_F(SaaSimulatorLines, AFallingEdgeOnClkGivesAFrame) {
  ASSERT_EQ(Make(kHandshake, "a: {bits: 14}", "{a: {start_deg: 8.416, processing_us: 100}}"), "");
  Pulse(0, 20 * kMicrosecond, kStart + 20 * kMicrosecond);
  RunUntil(kStart + kSecond);
  ASSERT_EQ(heard_.size(), 1U);
  EXPECT_EQ(heard_[0].first, kStart + 5'100 * kMicrosecond) << "T3 and five characters after the edge";
  Send("BC AA B1", kStart + kSecond);
  RunUntil(kStart + 2 * kSecond);
  EXPECT_EQ(heard_.size(), 1U) << "it takes no commands";
}

// 5.1.3: T2 >= 10 us.
TEST_F(SaaSimulatorLines, AShortPulseOnClkIsDropped) {
  ASSERT_EQ(Make(kHandshake, "a: {bits: 14}", "{}"), "");
  Pulse(0, 9 * kMicrosecond, kStart + 9 * kMicrosecond);
  RunUntil(kStart + kSecond);
  EXPECT_THAT(heard_, IsEmpty());
  EXPECT_EQ(Value("short_pulses"), "1");
}

TEST_F(SaaSimulatorLines, APulseWhileItWorksOnTheLastIsDropped) {
  ASSERT_EQ(Make(kHandshake, "a: {bits: 14}", "{}"), "");
  Pulse(0, 20 * kMicrosecond, kStart + 20 * kMicrosecond);
  Pulse(0, 20 * kMicrosecond, kStart + 3 * kMillisecond);
  RunUntil(kStart + kSecond);
  EXPECT_EQ(heard_.size(), 1U);
  EXPECT_EQ(Value("fast_pulses"), "1");
}

TEST_F(SaaSimulatorLines, AFallingEdgeOnClrClearsToZeroWhereTheShaftWas) {
  ASSERT_EQ(Make(kTiming, "a: {bits: 14}", "{a: {start_deg: 90}}"), "");
  Pulse(0, kMillisecond, kStart + kMillisecond);
  EXPECT_EQ(Value("single_turn"), "0");
  EXPECT_EQ(Value("zeroings"), "1");
}

TEST_F(SaaSimulatorLines, StreamsAtItsRefreshRateWhatItSampled) {
  ASSERT_EQ(Make(kTiming, "a: {bits: 14}", "{a: {start_deg: 8.416, processing_us: 0}}"), "");
  RunUntil(kStart + kSecond);
  EXPECT_NEAR(static_cast<double>(heard_.size()), 50, 1);
  EXPECT_EQ(heard_.at(1).first - heard_.at(0).first, 20 * kMillisecond);
  EXPECT_EQ(heard_[0].second, GoldenBytes("FF 81 01 7F 00"));
  ASSERT_EQ(ErrorText(simulator_->Set("a", "refresh_hz", "100", now_)), "");
  heard_.clear();
  RunUntil(kStart + 2 * kSecond);
  EXPECT_NEAR(static_cast<double>(heard_.size()), 100, 2);
}

TEST_F(SaaSimulatorTest, MistakesAreNamed) {
  EXPECT_THAT(Make(kBus, kDevices, "{a: {sped_rpm: 60}}"), HasSubstr("did you mean 'speed_rpm'"));
  EXPECT_THAT(Make(kBus, kDevices, "{c: {speed_rpm: 60}}"), HasSubstr("unknown key 'c'"));
  EXPECT_THAT(Make(kBus, kDevices, "{a: {reply_header: b1}}"), HasSubstr("one of 81, address"));
  EXPECT_THAT(Make(kBus, kDevices, "{a: {fault: broken}}"), HasSubstr("fault"));
}

}  // namespace
}  // namespace axlecast::saa_serial
