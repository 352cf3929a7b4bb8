#include "drivers/biss/settings.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <array>

#include "drivers/biss/machine_test_support.h"
#include "drivers/saa/table_test_support.h"

namespace axlecast {

const Family& biss_family();

// A program that links one family has a table of one.
std::span<const Family* const> Families() {
  static const std::array<const Family*, 1> kFamilies = {&biss_family()};
  return kFamilies;
}

namespace biss {
namespace {

using ::testing::HasSubstr;

BissSettings SettingsOf(const std::string& bus_keys, const std::string& keys) {
  return Own(LoadMachine(bus_keys, keys).buses.at(0).devices.at(0));
}

// 4.1, 4.2, 5.6.
TEST(BissSettings, KnowTheManualsDefaults) {
  const BissSettings settings = SettingsOf("", "bits: 16");
  EXPECT_EQ(settings.model, "saa");
  EXPECT_EQ(settings.counts_per_turn, 65'536);
  EXPECT_EQ(settings.turns_range, 0) << "single-turn";
  EXPECT_EQ(settings.max_speed_rpm, 5'000);
  EXPECT_EQ(settings.format.crc.bits, 6);
  EXPECT_EQ(settings.format.crc.polynomial, 0b100'0011U) << "x^6 + x + 1";
  EXPECT_EQ(settings.format.crc.start, 0U);
  EXPECT_TRUE(settings.format.crc.inverted);
  EXPECT_EQ(settings.spi.mode, 2) << "idles high, sampled on the falling edges";
  EXPECT_EQ(settings.spi.clock_hz, 1'000'000);
  const MachineConfig machine = LoadMachine("", "bits: 16");
  EXPECT_EQ(machine.buses[0].poll_hz, 1'000);
  EXPECT_EQ(OwnBus(machine.buses[0]).timeout, 16 * kMicrosecond);
}

// Two samples before the acknowledgement, the delay, the busy time, start bit, 0, 16 + 2 + 6 bits; whole bytes.
TEST(BissSettings, ATransferIsAsLongAsTheLatestFrame) {
  const BissSettings settings = SettingsOf("line_delay_ns: 3000", "bits: 16, busy_us: 10");
  EXPECT_EQ(settings.search.latest_ack, 2U + 3);
  EXPECT_EQ(settings.search.latest_start, 2U + 3 + 10 + 1);
  EXPECT_EQ(settings.transfer_bytes, (17U + 1 + 24 + 7) / 8);
  EXPECT_EQ(settings.wire_time,
            8 * static_cast<MonoNs>(settings.transfer_bytes) * kMicrosecond + 23 * kMicrosecond);
  const BissSettings quick = SettingsOf("line_delay_ns: 0", "bits: 10, busy_us: 0");
  EXPECT_EQ(quick.search.latest_ack, 2U);
  EXPECT_EQ(quick.search.latest_start, 5U) << "two clocks of Tbusy, and one to wait for";
  const BissSettings longest = SettingsOf("line_delay_ns: 20000, link: {clock_hz: 9999999}",
                                          "model: custom, max_speed_rpm: 1, bits: 32, turn_bits: 20, busy_us: 150, "
                                          "crc: {bits: 16, poly: 0x11021}");
  EXPECT_LE(longest.transfer_bytes, kMaxFrame);
  EXPECT_EQ(longest.search.latest_ack, 202U);
}

TEST(BissSettings, TheOtherMode) {
  EXPECT_EQ(SettingsOf("sample_on: rising", "bits: 16").spi.mode, 3);
  EXPECT_EQ(SettingsOf("sample_on: falling, link: {clock_hz: 9999999}", "bits: 16").spi.clock_hz, 9'999'999);
}

TEST(BissSettings, AnotherEncoder) {
  const BissSettings settings =
      SettingsOf("",
                 "model: custom, bits: 32, turn_bits: 12, max_speed_rpm: 12000, noise_counts: 9, "
                 "crc: {bits: 8, poly: 0x97, start: 0xFF, inverted: false}");
  EXPECT_EQ(settings.turns_range, 4'096);
  EXPECT_EQ(settings.counts_per_turn, std::int64_t{1} << 32U);
  EXPECT_EQ(settings.max_speed_rpm, 12'000);
  EXPECT_EQ(settings.noise_counts, 9);
  EXPECT_EQ(settings.format.crc.polynomial, 0x197U);
  EXPECT_EQ(settings.format.crc.start, 0xFFU);
  EXPECT_FALSE(settings.format.crc.inverted);
}

TEST(BissSettings, APolynomialWithItsHighestTermOrWithout) {
  EXPECT_EQ(Polynomial(0x43, 6), 0x43U);
  EXPECT_EQ(Polynomial(0x03, 6), 0x43U);
  EXPECT_EQ(Polynomial(0x97, 7), 0x97U) << "x^7 + x^4 + x^2 + x + 1";
  EXPECT_EQ(Polynomial(0x97, 8), 0x197U);
  EXPECT_EQ(Polynomial(0x190D9, 16), 0x190D9U);
  EXPECT_EQ(Polynomial(0x42, 6), 0U) << "no + 1";
  EXPECT_EQ(Polynomial(0x83, 6), 0U) << "more than six bits";
  EXPECT_EQ(Polynomial(0, 6), 0U);
}

// 4.1, every column of the table; another maker's encoder of more bits is taken to be as good as the best.
TEST(BissSettings, TheNoiseIsTwiceTheAccuracyOfTheTable) {
  const auto noise = [](const std::string& keys) { return SettingsOf("", keys).noise_counts; };
  for (const saa::TableColumn& column : saa::kTable41) {
    EXPECT_EQ(noise("bits: " + std::to_string(column.bits)), column.noise) << column.bits;
  }
  for (int bits = 10; bits < 16; ++bits) EXPECT_EQ(noise("bits: " + std::to_string(bits)), 1) << "none is given";
  EXPECT_EQ(noise("model: custom, max_speed_rpm: 1, bits: 32"), 33'141);
}

TEST(BissMistake, EachIsNamedWithWhatWouldBeRight) {
  struct Case {
    const char* bus_keys;
    const char* keys;
    const char* text;
  };
  for (const Case& c : {
           Case{"", "unit: deg", "bits: is missing: the resolution, 10 to 26"},
           Case{"", "bits: 9", "'9' is not within 10 to 26"},
           Case{"", "bits: 27", "'27' is not within 10 to 26"},
           Case{"", "model: custom, max_speed_rpm: 1, bits: 33", "'33' is not within 10 to 32"},
           Case{"", "model: custom, bits: 16", "max_speed_rpm: is missing"},
           Case{"", "bits: 16, max_speed_rpm: 100", "only model custom takes it"},
           Case{"", "model: custom, max_speed_rpm: 1, bits: 32, turn_bits: 21", "21 and bits 32 are more than 52"},
           Case{"", "bits: 16, crc: {bits: 8}", "poly: is missing"},
           Case{"", "bits: 16, crc: {poly: 0x42}", "0x42 is no polynomial of 6 bits that ends with + 1"},
           Case{"", "bits: 16, crc: {start: 64}", "'64' is not within 0 to 63"},
           Case{"", "bits: 16, crc: {polynomial: 3}", "unknown key 'polynomial'"},
           Case{"", "bits: 16, busy_us: 151", "'151' is not within 0 to 150"},
           Case{"link: {clock_hz: 10000000}", "bits: 16",
                "a cycle must be longer than 100 ns (SAA manual 5.6, TMAS), below 10000000 Hz"},
           Case{"link: {clock_hz: 62500}", "bits: 16", "62501 Hz at least"},
           Case{"timeout_us: 0", "bits: 16", "'0' is not within 1 to 1000"},
           Case{"line_delay_ns: 20001", "bits: 16", "is not within 0 to 20000"},
           Case{"sample_on: high", "bits: 16", "'high' is not one of falling, rising"},
           Case{"poll_hz: 17000", "bits: 16", "is more than the wire carries"},
       }) {
    EXPECT_THAT(ProblemOf(c.bus_keys, c.keys), HasSubstr(c.text)) << c.bus_keys << " | " << c.keys;
  }
}

TEST(BissMistake, OneEncoderPerBus) {
  ConfigErrors errors("test.yaml");
  static_cast<void>(
      ParseConfig("machine: m\nbuses:\n  b: {family: biss, simulate: true, devices: {a: {bits: 16}, "
                  "c: {bits: 16}}}\n",
                  errors));
  EXPECT_THAT(errors.Text(), HasSubstr("point to point"));
}

}  // namespace
}  // namespace biss
}  // namespace axlecast
