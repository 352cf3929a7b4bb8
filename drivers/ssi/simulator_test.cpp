#include "drivers/ssi/simulator.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "drivers/ssi/family.h"
#include "drivers/ssi/test_support.h"

namespace axlecast::ssi {
namespace {

using After = SimulatedOutput::AfterWord;

// What is written in groups.
std::string Line(std::string groups) {
  std::erase(groups, ' ');
  return groups;
}

// An encoder of 12 bits at 495, as the manual has it, and a host that clocks it.
class SimulatedSsi {
 public:
  explicit SimulatedSsi(SimulatedEncoder::Properties properties = {}, double degrees = 495 * 360.0 / 4096 + 0.01)
      : simulator_("axis1", SimulatedEncoder(std::move(properties), ShaftStart{AngleFromDegrees(degrees), 1}),
                   Script(), {0, 1e6}) {}

  // The levels of this number of bytes. `now` advances by their clocks and the pause.
  std::string Clock(std::size_t bytes, const SpiSettings& settings = {.mode = 2, .clock_hz = 100'000}) {
    std::vector<std::uint8_t> rx(bytes);
    const std::vector<std::uint8_t> tx(bytes);
    simulator_.OnTransfer({.settings = settings, .bits_per_word = 8, .tx = tx}, now, rx);
    now += settings.ClockTime(static_cast<std::int64_t>(bytes) * 8) + pause;
    return LevelText(rx);
  }
  void Set(const std::string& key, const std::string& value) {
    EXPECT_EQ(ErrorText(simulator_.Set("axis1", key, value, now)), "");
  }
  [[nodiscard]] const SsiSimulator::Counters& counters() const { return simulator_.counters(); }
  [[nodiscard]] SsiSimulator& simulator() { return simulator_; }

  MonoNs now = kSecond;
  MonoNs pause = kMillisecond;

 private:
  SsiSimulator simulator_;
};

// SAA manual 5.5 (1), (2): idle high, the first falling edge stores, MSB first; "the extra clock will read out repeat
// the high-order data".
TEST(SsiSimulator, TheManualsExample) {
  SimulatedSsi ssi({.after_word = After::kNoGap});
  EXPECT_EQ(ssi.Clock(2), Line("1 000111101111 000"));
  EXPECT_EQ(ssi.Clock(4), Line("1 000111101111 000111101111 0001111"));
  EXPECT_EQ(ssi.counters().latches, 2);
  EXPECT_EQ(ssi.counters().wrong_mode + ssi.counters().slow_clocks + ssi.counters().short_pauses +
                ssi.counters().late_data + ssi.counters().few_clocks + ssi.counters().fast_clocks,
            0);
}

// TWK SSI 4, 7: a zero separates the repeated words; "alternatively" the line stays at 0.
TEST(SsiSimulator, AfterTheWord) {
  SimulatedSsi once({.after_word = After::kZeros});
  EXPECT_EQ(once.Clock(4), Line("1 000111101111 0000000000000000000"));
  SimulatedSsi again({.after_word = After::kOneZero});
  EXPECT_EQ(again.Clock(4), Line("1 000111101111 0 000111101111 0 00011"));
}

// TWK SSI 5: the 18-bit encoder: 4 blanks, 8 multi-turn bits, S10 to S1, three zeros; Gray.
TEST(SsiSimulator, TheTreesExampleOf18Bits) {
  const SimulatedWord word = {.length = 25, .position_at = 4, .turn_bits = 8, .bits = 10, .gray = true};
  const auto text = [&](std::uint32_t turns, std::uint32_t counts) {
    std::string levels;
    for (const bool level : word.Make(turns, counts, 0)) levels += level ? '1' : '0';
    return levels;
  };
  EXPECT_EQ(text(255, 1023), Line("0000 10000000 0000000000 000"));
  EXPECT_EQ(text(0, 1), Line("0000 00000000 0000000001 000"));
  EXPECT_EQ(text(1, 0), Line("0000 00000001 1000000000 000"));
}

// TWK SSI 10: t_W = t_M: before the monoflop has expired, the clock continues the old word.
TEST(SsiSimulator, TooShortAPauseGivesMoreOfTheOldWord) {
  SimulatedSsi ssi({.monoflop_us = 25});
  ssi.pause = 10 * kMicrosecond;
  EXPECT_EQ(ssi.Clock(2), Line("1 000111101111 000"));
  EXPECT_EQ(ssi.Clock(2), "0000000000000000");
  EXPECT_EQ(ssi.counters().short_pauses, 1);
  EXPECT_EQ(ssi.counters().latches, 1);
  ssi.now += 100 * kMicrosecond;
  EXPECT_EQ(ssi.Clock(2), Line("1 000111101111 000"));
}

// TWK SSI 10: t_T < t_M: a slower clock lets the monoflop expire after each edge: every falling edge latches again.
TEST(SsiSimulator, TooSlowAClockNeverGetsBeyondTheFirstBit) {
  SimulatedSsi ssi({.monoflop_us = 15}, 200);
  EXPECT_EQ(ssi.Clock(2, {.mode = 2, .clock_hz = 60'000}), Line("1111111111111111"));
  ssi.Set("motion", "move:0,6000");
  ssi.now += kSecond;
  EXPECT_EQ(ssi.Clock(2, {.mode = 2, .clock_hz = 60'000}), Line("1111111111111111"));
  // Here the line's delay shows the first bit a little longer.
  EXPECT_EQ(ssi.Clock(2, {.mode = 2, .clock_hz = 66'000}), Line("1000000000000000"));
  EXPECT_EQ(ssi.counters().slow_clocks, 3);
  EXPECT_EQ(ssi.counters().monoflop_ends, 3);
  EXPECT_EQ(ssi.Clock(2, {.mode = 2, .clock_hz = 67'000}), Line("1 000000000000 000"));
  EXPECT_EQ(ssi.counters().slow_clocks, 3);
}

// The same within a word when the host's controller rests between two bytes.
TEST(SsiSimulator, AGapBetweenBytesCanEndTheMonoflop) {
  SimulatedSsi ssi({.monoflop_us = 15});
  ssi.Set("byte_gap_us", "4");
  EXPECT_EQ(ssi.Clock(2), Line("1 000111101111 000"));
  ssi.Set("byte_gap_us", "6");
  EXPECT_EQ(ssi.Clock(3), Line("1 0001111 1 0001111 1 0001111"));
  EXPECT_EQ(ssi.counters().monoflop_ends, 1);
}

// TWK SSI 11.3: 2900 ns at 200 m. Half a cycle later the bit must be there.
TEST(SsiSimulator, TooFastForTheCableSamplesOldBits) {
  SimulatedSsi ssi({.cable_m = 200});
  EXPECT_EQ(ssi.Clock(2, {.mode = 2, .clock_hz = 172'000}), Line("1 000111101111 000"));
  EXPECT_EQ(ssi.counters().late_data, 0);
  EXPECT_EQ(ssi.Clock(2, {.mode = 2, .clock_hz = 175'000}), Line("11 000111101111 00"));
  EXPECT_EQ(ssi.counters().late_data, 1);
  // Mode 3 samples a whole cycle after the edge, and reaches the document's 300 kHz; we do not rely on it.
  EXPECT_EQ(ssi.Clock(2, {.mode = 3, .clock_hz = 300'000}), Line("1 000111101111 000"));
}

// Sampled at the rising edge that follows, or idle low: the bits are shifted, and it is counted.
TEST(SsiSimulator, OtherModes) {
  SimulatedSsi ssi;
  EXPECT_EQ(ssi.Clock(2, {.mode = 0, .clock_hz = 100'000}), Line("11 000111101111 00"));
  EXPECT_EQ(ssi.counters().wrong_mode, 1);
  EXPECT_EQ(ssi.Clock(2, {.mode = 1, .clock_hz = 100'000}), Line("1 000111101111 000"));
  EXPECT_EQ(ssi.counters().wrong_mode, 2);
}

// TWK SSI 2: n + 1 clocks for n bits; SAA manual 5.5 warns of fewer.
TEST(SsiSimulator, TooFewClocks) {
  SimulatedSsi ssi;
  EXPECT_EQ(ssi.Clock(1), Line("1 0001111"));
  EXPECT_EQ(ssi.counters().few_clocks, 1);
}

// SAA manual 5.5 (2): 100 kHz < f < 250 kHz, Tcs > 4 us, Tm > 500 us.
TEST(SsiSimulator, TheManualsTimes) {
  const MachineConfig machine = LoadMachine("simulate: true", "model: saa, bits: 12");
  ConfigErrors errors("test");
  const auto made = MakeSimulator(machine, machine.buses[0], errors);
  auto& simulator = dynamic_cast<SsiSimulator&>(*made);
  MonoNs now = kSecond;
  const auto clock = [&](std::int64_t hz, MonoNs pause) {
    const std::vector<std::uint8_t> tx(2);
    std::vector<std::uint8_t> rx(2);
    simulator.OnTransfer({.settings = {.mode = 2, .clock_hz = hz}, .bits_per_word = 8, .tx = tx}, now, rx);
    now += 16 * kSecond / hz + pause;
  };
  clock(100'001, 501 * kMicrosecond);
  clock(249'999, 501 * kMicrosecond);
  clock(200'000, 490 * kMicrosecond);
  EXPECT_EQ(simulator.counters().slow_clocks + simulator.counters().fast_clocks, 0);
  EXPECT_EQ(simulator.counters().short_pauses, 0);
  clock(200'000, kMillisecond);
  EXPECT_EQ(simulator.counters().short_pauses, 1);
  clock(100'000, kMillisecond);
  EXPECT_EQ(simulator.counters().slow_clocks, 1);
  clock(250'000, kMillisecond);
  EXPECT_EQ(simulator.counters().fast_clocks, 1);
}

TEST(SsiSimulator, Faults) {
  SimulatedSsi ssi;
  const std::vector<std::pair<std::string, std::string>> rows = {
      {"off", "1111111111111111"},       {"intermittent:1", "1111111111111111"},
      {"echo", "0000000000000000"},      {"stuck", "1000111101111000"},
      {"slow:6", "1100011110111100"},    {"request_flip:1", "1111111111111111"},
      {"bit_flip:1", "0111000010000111"}};
  for (const auto& [fault, levels] : rows) {
    ssi.Set("fault", fault);
    EXPECT_EQ(ssi.Clock(2), levels) << fault;
  }
  ssi.Set("fault", "garbage");
  EXPECT_NE(ssi.Clock(2), ssi.Clock(2));
  ssi.Set("fault", "short:1");
  std::set<std::string> seen;
  for (int i = 0; i < 50; ++i) seen.insert(ssi.Clock(2));
  EXPECT_GT(seen.size(), 5U);
  ssi.Set("fault", "none");
  ssi.Set("data_line", "swapped");
  EXPECT_EQ(ssi.Clock(2), "0111000010000111");
  ssi.Set("data_line", "low");
  EXPECT_EQ(ssi.Clock(2), "0000000000000000");
  ssi.Set("data_line", "high");
  EXPECT_EQ(ssi.Clock(2), "1111111111111111");
  ssi.Set("data_line", "encoder");
  ssi.Set("power", "off");
  EXPECT_EQ(ssi.Clock(2), "1111111111111111");
  EXPECT_EQ(ssi.counters().unanswered, 3);
  EXPECT_THAT(ErrorText(ssi.simulator().Set("axis1", "fault", "delayed:5", ssi.now)),
              testing::HasSubstr("nothing is held back"));
}

TEST(SsiSimulator, StatusAndParityBits) {
  SimulatedEncoder::Properties properties;
  properties.word = {.length = 15, .flags = {{"alarm", 12, true}, {"power_fail", 13, false}}, .parity_at = 14};
  SimulatedSsi ssi(std::move(properties));
  EXPECT_EQ(ssi.Clock(2), Line("1 000111101111 0 1 1"));
  ssi.Set("status", "alarm power_fail");
  EXPECT_EQ(ssi.Clock(2), Line("1 000111101111 1 0 1"));
  ssi.Set("status", "power_fail");
  EXPECT_EQ(ssi.Clock(2), Line("1 000111101111 0 0 0"));
  ssi.Set("status", "none");
  EXPECT_NE(ErrorText(ssi.simulator().Set("axis1", "status", "smoke", ssi.now)), "");
  const auto state = ssi.simulator().State("axis1", ssi.now);
  EXPECT_THAT(state, testing::Contains(testing::Pair("status", "none")));
  EXPECT_THAT(state, testing::Contains(testing::Pair("single_turn", "495")));
}

// The position is that of the first falling edge, wherever the shaft is when the bits come.
TEST(SsiSimulator, ItStoresAtTheFirstFallingEdge) {
  SimulatedSsi ssi({}, 0);
  ssi.Set("accel_rad_s2", "100000");
  ssi.Set("speed_rpm", "6000");
  ssi.now += 2 * kSecond;
  for (int i = 0; i < 20; ++i) {
    ssi.now += 7'123'457;
    const auto state = ssi.simulator().State("axis1", ssi.now);
    const std::string counts = std::find_if(state.begin(), state.end(), [](const auto& entry) {
                                 return entry.first == "single_turn";
                               })->second;
    EXPECT_EQ(std::stoi(ssi.Clock(2).substr(1, 12), nullptr, 2), std::stoi(counts));
  }
}

TEST(SsiSimulator, WrongKeysAreRefused) {
  const std::vector<std::pair<std::string, std::string>> rows = {
      {"after_word: word", "is not one of zeros, one_zero"},
      {"monoflop_us: 0", "us"},
      {"data_line: open", "is not one of encoder"},
      {"start_turns: 1", "turns"},
      {"cable: 3", "unknown"}};
  for (const auto& [keys, problem] : rows) {
    const MachineConfig machine = LoadMachine("simulate: {axis1: {" + keys + "}}", "model: saa, bits: 12");
    ConfigErrors errors("test");
    EXPECT_EQ(MakeSimulator(machine, machine.buses[0], errors), nullptr);
    EXPECT_THAT(errors.Text(), testing::HasSubstr(problem)) << keys;
  }
}

}  // namespace
}  // namespace axlecast::ssi
