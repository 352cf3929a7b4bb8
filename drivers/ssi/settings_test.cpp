#include "drivers/ssi/settings.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "drivers/saa/table_test_support.h"
#include "drivers/ssi/test_support.h"

namespace axlecast::ssi {
namespace {

using testing::HasSubstr;

constexpr const char* kPort = "link: {spidev: /dev/spidev0.0}";

struct Loaded {
  explicit Loaded(const std::string& device, const std::string& keys = kPort)
      : machine(LoadMachine(keys, device)) {}
  MachineConfig machine;
  [[nodiscard]] const SsiBus& bus() const { return OwnBus(machine.buses[0]); }
  [[nodiscard]] const SsiSettings& settings() const { return Own(machine.buses[0].devices[0]); }
};

TEST(SsiSettings, AnSaaEncoder) {
  const Loaded saa("model: saa58p24, bits: 12");
  const SsiSettings& settings = saa.settings();
  EXPECT_EQ(settings.model, "saa58p24");
  EXPECT_EQ(settings.counts_per_turn, 4096);
  EXPECT_EQ(settings.turns_range, 0);
  EXPECT_EQ(settings.max_speed_rpm, 5000);  // 4.2
  EXPECT_FALSE(settings.format.gray);
  EXPECT_FALSE(settings.format.trailing_checked);
  EXPECT_EQ(settings.spi.mode, 2);
  // 5.5 (2): 100 kHz < f < 250 kHz, Tcs > 4 us; Tm > 500 us.
  EXPECT_GT(settings.spi.clock_hz, 100'000);
  EXPECT_LT(settings.spi.clock_hz, 250'000);
  EXPECT_GT(kSecond / settings.spi.clock_hz, 4 * kMicrosecond);
  EXPECT_GT(saa.bus().pacing.after_reply, 500 * kMicrosecond);
  EXPECT_EQ(settings.wire_time, settings.spi.ClockTime(16) + saa.bus().pacing.after_reply);
}

TEST(SsiSettings, ATwkEncoder) {
  const Loaded twk("model: twk, bits: 10, turn_bits: 8");
  const SsiSettings& settings = twk.settings();
  EXPECT_EQ(settings.counts_per_turn, 1024);
  EXPECT_EQ(settings.turns_range, 256);
  EXPECT_TRUE(settings.format.gray);
  EXPECT_TRUE(settings.format.joint);
  EXPECT_TRUE(settings.format.trailing_checked);
  EXPECT_EQ(settings.format.after, AfterWord::kZeros);
  EXPECT_EQ(settings.format.word_bits, 25);
  // TWK SSI 10: 15 us <= t_M <= 25 us.
  EXPECT_GT(twk.bus().pacing.after_reply, 25 * kMicrosecond);
  EXPECT_LT(twk.bus().pacing.after_reply, 30 * kMicrosecond);
  EXPECT_LT(kSecond / settings.spi.clock_hz, 15 * kMicrosecond);
}

TEST(SsiSettings, TheChosenClockFitsTheCable) {
  const Loaded twk("model: twk, bits: 13, turn_bits: 12", std::string(kPort) + ", cable_m: 200");
  EXPECT_DOUBLE_EQ(twk.bus().plan.delay_ns, 2900);  // TWK SSI 11.3
  EXPECT_LT(twk.settings().spi.clock_hz, 172'414);
  const Loaded asked("model: twk, bits: 13", "link: {spidev: /dev/spidev0.0, clock_hz: 172000}, cable_m: 200");
  EXPECT_EQ(asked.settings().spi.clock_hz, 172'000);
}

TEST(SsiSettings, StatusBitsMakeTheWordLonger) {
  const Loaded own(
      "model: custom, code: binary, bits: 12, turn_bits: 12, first_bit: 2, status_bits: {ready: {bit: 1, active: "
      "low, "
      "severity: warning}, alarm: {bit: 26}}, parity: {bit: 28, sense: odd}",
      std::string(kPort) + ", monoflop_us: {min: 10, max: 30}");
  const SsiSettings& settings = own.settings();
  EXPECT_EQ(settings.format.word_bits, 28);
  EXPECT_EQ(settings.format.first, 1);
  EXPECT_EQ(settings.format.parity, ParityRule::kOdd);
  ASSERT_EQ(settings.status_bits.size(), 2U);
  EXPECT_EQ(settings.status_bits[0].name, "ready");
  EXPECT_EQ(settings.status_bits[0].place, 0);
  EXPECT_FALSE(settings.status_bits[0].active_high);
  EXPECT_FALSE(settings.status_bits[0].is_error);
  EXPECT_EQ(settings.status_bits[1].place, 25);
  EXPECT_TRUE(settings.status_bits[1].is_error);
  // TWK SSI 10: "Maximum wait time t_W = t_M (max.) = 30 us"; 100 kHz at 10 us.
  EXPECT_GT(own.bus().pacing.after_reply, 30 * kMicrosecond);
  EXPECT_DOUBLE_EQ(own.bus().plan.lowest_hz, 100e3);
}

// A status bit in a place where the tree has a zero does not belong to the padding.
TEST(SsiSettings, StatusBitsInTheTreesPadding) {
  const Loaded twk("model: twk, bits: 10, turn_bits: 8, status_bits: {alarm: {bit: 25}}");
  EXPECT_EQ(ParseWord(1, twk.settings().format).error, WordError::kNone);
  EXPECT_EQ(ParseWord(2, twk.settings().format).error, WordError::kPadding);
  EXPECT_EQ(ParseWord(std::uint64_t{1} << 24U, twk.settings().format).error, WordError::kPadding);
  const Loaded longer("model: twk, bits: 10, turn_bits: 8, status_bits: {alarm: {bit: 26}}");
  EXPECT_EQ(longer.settings().format.word_bits, 26);
  EXPECT_EQ(ParseWord(1, longer.settings().format).error, WordError::kNone);
  EXPECT_EQ(ParseWord(2, longer.settings().format).error, WordError::kPadding);
}

TEST(SsiSettings, RepeatAndTrailing) {
  const Format one_zero = Loaded("model: twk, bits: 13, repeat: one_zero").settings().format;
  EXPECT_EQ(one_zero.words, 2);
  EXPECT_EQ(one_zero.after, AfterWord::kZeroThenWord);
  EXPECT_TRUE(one_zero.trailing_checked);
  const Format loose =
      Loaded("model: twk, bits: 13, repeat: one_zero, words: 3, trailing: unchecked").settings().format;
  EXPECT_EQ(loose.words, 3);
  EXPECT_FALSE(loose.trailing_checked);
  // What an encoder that repeats does between the words is its maker's.
  EXPECT_EQ(Loaded("model: saa, bits: 12, trailing: repeat").settings().format.after, AfterWord::kWord);
  EXPECT_EQ(Loaded("model: twk, bits: 12, trailing: repeat").settings().format.after, AfterWord::kZeroThenWord);
  EXPECT_EQ(Loaded("model: saa, bits: 12, repeat: no_gap").settings().format.after, AfterWord::kWord);
}

// SAA manual 4.1: "Accuracy <=", every column; two readings of one place differ by twice that at most. TWK gives none.
TEST(SsiSettings, TheNoiseIsTwiceTheAccuracyOfTheTable) {
  const auto noise = [](const std::string& device) { return Loaded(device).settings().noise_counts; };
  for (const saa::TableColumn& column : saa::kTable41) {
    EXPECT_EQ(noise("model: saa, bits: " + std::to_string(column.bits)), column.noise) << column.bits;
  }
  for (int bits = 10; bits < 16; ++bits) {
    EXPECT_EQ(noise("model: saa, bits: " + std::to_string(bits)), 1) << "the table gives none";
  }
  EXPECT_EQ(noise("model: twk, format: plain, bits: 20"), 1);
}

struct Mistake {
  std::string keys;
  std::string device;
  std::string problem;
};

TEST(SsiMistake, IsNamedWithWhatIsRight) {
  const std::string port = kPort;
  const std::string line = "link: {spidev: /dev/spidev0.0, clock_hz: ";
  const std::string saa = "model: saa, bits: 12";
  const std::string twk = "model: twk, bits: 13";
  const std::string own = "model: custom, code: gray, bits: 12";
  const std::string flop = port + ", monoflop_us: {min: 15, max: 25}";
  const std::vector<Mistake> rows = {
      // Clock and line: refused with the computed limit.
      {line + "100000}", saa, "100000 is too slow, above 100000 Hz"},
      {line + "250000}", saa, "250000 is too fast, below 250000 Hz: max_clock_hz"},
      {line + "60000}", twk,
       "60000 is too slow, above 66667 Hz: its cycle must be shorter than the monoflop's 15 us"},
      {line + "300000}, cable_m: 200", twk,
       "300000 is too fast, below 172414 Hz: half a cycle must be longer than the 2900 ns"},
      {line + "900000}, cable_m: 20, max_clock_hz: 2000000", twk, "below 892857 Hz"},
      {port + ", cable_m: 1000", saa, "no clock is right for this line: above 100000 Hz"},
      {port + ", cable_m: 1000", saa, "below 37594 Hz"},
      {port +
           ", cable_m: 600, cable_ns_per_m: 3.3, encoder_delay_ns: 0, receiver_delay_ns: 0, min_clock_hz: 110000",
       saa, "below 100000 Hz: what RS-422 allows over 600 m"},
      {port + ", pause_us: 500", saa, "500 is too short"},
      {port + ", pause_us: 20", twk, "above 25 us, or set monoflop_us"},
      {port + ", monoflop_us: {min: 30, max: 20}", twk, "max"},
      // The model.
      {port, "bits: 12", "model: is missing: saa, twk, or custom"},
      {port, "model: sick, bits: 12", "'sick'"},
      {port, own, "monoflop_us: is missing"},
      {flop, "model: custom, bits: 12", "code: is missing"},
      {port, saa + ", max_speed_rpm: 3000", "is known of model saa"},
      // The word.
      {port, "model: saa", "bits: is missing"},
      {port, "model: saa, bits: 9", "10 to 26"},
      {port, "model: saa, bits: 27", "10 to 26"},
      {port, saa + ", turn_bits: 4", "SAA encoders are single-turn"},
      {port, "model: twk, bits: 14", "for more format: plain"},
      {port, twk + ", turn_bits: 13", "turn_bits"},
      {port, twk + ", first_bit: 2", "is fixed in format tree25"},
      {flop, "model: custom, code: gray, bits: 5, turn_bits: 4", "9 bits in all are too few"},
      {flop, "model: custom, code: gray, bits: 20, turn_bits: 13", "turn_bits"},
      {flop, own + ", format: plain, halves: separate", "only with code: gray and turn_bits"},
      {port, saa + ", words: 2", "needs repeat"},
      {port, twk + ", repeat: one_zero, trailing: zero", "zero contradicts repeat"},
      {flop, own + ", status_bits: {alarm: {bit: 12}}", "12 is a bit of the position (bits 1 to 12)"},
      {flop, own + ", status_bits: {alarm: {bit: 13}, warning: {bit: 13}}", "13 is taken already"},
      {flop, own + ", status_bits: {alarm: {bit: 13}}, parity: {bit: 13, sense: odd}", "13 is taken already"},
      {flop, own + ", status_bits: {alarm: {}}", "bit: is missing"},
      {flop, own + ", status_bits: {Alarm!: {bit: 13}}", "is no name of an alarm"},
      {flop, own + ", parity: {bit: 13}", "sense: is missing"},
      {flop,
       own +
           ", status_bits: {a: {bit: 14}, b: {bit: 15}, c: {bit: 16}, d: {bit: 17}, e: {bit: 18}, f: {bit: 19}, g: "
           "{bit: 20}, h: {bit: 21}, i: {bit: 22}}",
       "9 are too many"},
      {flop, own + ", word_bits: 11", "no fewer than position"},
      {flop, own + ", all_ones: position, trailing: zero", "a zero must always come"},
      {flop, own + ", gray: true", "unknown"}};
  for (const Mistake& row : rows) {
    EXPECT_THAT(ProblemOf(row.keys, row.device), HasSubstr(row.problem)) << row.keys << ' ' << row.device;
  }
}

TEST(SsiMistake, OneEncoderOnABus) {
  ConfigErrors errors("test.yaml");
  static_cast<void>(
      ParseConfig("machine: t\nbuses:\n  b: {family: ssi, link: {spidev: /dev/spidev0.0}, devices: {a: "
                  "{model: saa, bits: 12}, c: {model: saa, bits: 12}}}\n",
                  errors));
  EXPECT_THAT(errors.Text(), HasSubstr("one device per bus"));
}

}  // namespace
}  // namespace axlecast::ssi
