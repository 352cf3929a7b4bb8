#include "drivers/saa_can/settings.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>

#include "drivers/saa/table_test_support.h"
#include "drivers/saa_can/machine_test_support.h"

namespace axlecast::saa_can {
namespace {

using testing::HasSubstr;

TEST(SaaCanSettings, FactorySettingsOfTheManual) {
  const MachineConfig machine = LoadMachine(kReal, "axis1: {bits: 14}");
  const BusConfig& bus = machine.buses.at(0);
  EXPECT_EQ(bus.link.bitrate, 250'000);
  EXPECT_FALSE(OwnBus(bus).bench);
  const SaaCanSettings& settings = Own(bus.devices.at(0));
  EXPECT_EQ(settings.node, 0x20);
  EXPECT_EQ(settings.mode, Mode::kCyclic);
  EXPECT_EQ(settings.period, 100 * kMillisecond);
  EXPECT_EQ(settings.own_period, settings.period);
  EXPECT_FALSE(settings.set_per_second);
  EXPECT_FALSE(settings.format.big_endian);
  EXPECT_EQ(settings.counts_per_turn, 1 << 14);
  EXPECT_EQ(settings.turns_range, 0);
  EXPECT_EQ(settings.max_speed_rpm, 5'000);  // 4.2
  EXPECT_EQ(settings.noise_counts, 1);
  EXPECT_EQ(settings.iface, "can0");
}

// 1NN and 2NN of the node, and the dialogue: nothing else passes the kernel.
TEST(SaaCanSettings, TheKernelFiltersWhatIsNotOfThisNode) {
  const MachineConfig machine = LoadMachine(kReal, "axis1: {bits: 14, node: 0x21}");
  const CanFilters& filters = machine.buses[0].devices[0].settings->can_filters;
  const auto passes = [&](std::uint32_t id) {
    return std::any_of(filters.begin(), filters.end(),
                       [id](const CanFilter& filter) { return Passes(filter, id); });
  };
  for (const std::uint32_t id : {0x121U, 0x221U, 0x7E4U, 0x7E5U}) EXPECT_TRUE(passes(id)) << id;
  for (const std::uint32_t id :
       {0x120U, 0x220U, 0x122U, 0x1A1U, 0x80U, 0x121U | kCanExtended, 0x121U | kCanRemote}) {
    EXPECT_FALSE(passes(id)) << id;
  }
}

// The operations of a bench go to every node, so the frames of every node must be received.
TEST(SaaCanSettings, ABenchHearsEverything) {
  const MachineConfig machine = LoadMachine(std::string("bench: true, ") + kReal, "axis1: {bits: 14}");
  const CanFilters& filters = machine.buses[0].devices[0].settings->can_filters;
  ASSERT_EQ(filters.size(), 1U);
  for (const std::uint32_t id : {0x000U, 0x1FFU, 0x7FFU, 0x1ABCDEFU | kCanExtended}) {
    EXPECT_TRUE(Passes(filters[0], id)) << id;
  }
}

TEST(SaaCanSettings, TimesOnTheWire) {
  const SaaCanSettings cyclic = Own(LoadMachine(kReal, "a: {bits: 14}").buses[0].devices[0]);
  // 8 bytes: 108 bits at least, 24 stuff bits and 3 between frames at most, at 4 us each.
  EXPECT_EQ(cyclic.wire_time, 540 * kMicrosecond);
  EXPECT_EQ(cyclic.wire.Shortest(8), 428 * kMicrosecond);
  const SaaCanSettings single = Own(LoadMachine(kReal, "a: {bits: 14, mode: single}").buses[0].devices[0]);
  EXPECT_EQ(single.wire_time, 1'080 * kMicrosecond);
  EXPECT_EQ(single.latch_after, 540 * kMicrosecond) << "the request";
  EXPECT_EQ(single.own_period, 0);
  // A simulated wire can be faster than any.
  EXPECT_EQ(Own(LoadMachine(kSimulated, "a: {bits: 14}").buses[0].devices[0]).wire.Longest(8), 0);
}

TEST(SaaCanSettings, APeriodThatIsToBeSetIsAWholeNumberASecond) {
  EXPECT_EQ(PerSecond(100), 10);
  EXPECT_EQ(PerSecond(4), 250);
  EXPECT_EQ(PerSecond(1'000), 1);
  for (const std::int64_t period : {0, 1, 2, 3, 30, 2'000}) EXPECT_FALSE(PerSecond(period)) << period;
  const SaaCanSettings set =
      Own(LoadMachine(kReal, "a: {bits: 14, period_ms: 20, set_period: true}").buses[0].devices[0]);
  EXPECT_EQ(set.set_per_second, 50);
}

// 4.1: accuracy, every column of the table, in counts rounded up.
TEST(SaaCanSettings, TheNoiseIsTwiceTheAccuracyOfTheTable) {
  const auto noise = [](int bits) {
    const MachineConfig machine = LoadMachine(kReal, "a: {bits: " + std::to_string(bits) + "}");
    return Own(machine.buses.at(0).devices.at(0)).noise_counts;
  };
  for (const saa::TableColumn& column : saa::kTable41) EXPECT_EQ(noise(column.bits), column.noise) << column.bits;
  for (int bits = 10; bits < 16; ++bits) EXPECT_EQ(noise(bits), 1) << "the table gives none";
}

// 0.2 degrees, and two counts at least: the manual gives no tolerance of a zero.
TEST(SaaCanSettings, AZeroMayMissBy) {
  EXPECT_EQ(ZeroToleranceCounts(10), 2);
  EXPECT_EQ(ZeroToleranceCounts(14), 9);
}

struct Mistake {
  const char* keys;
  const char* devices;
  const char* said;
};
class SaaCanMistake : public testing::TestWithParam<Mistake> {};

TEST_P(SaaCanMistake, IsNamed) {
  EXPECT_THAT(ProblemOf(GetParam().keys, GetParam().devices), HasSubstr(GetParam().said));
}

INSTANTIATE_TEST_SUITE_P(
    Of, SaaCanMistake,
    testing::Values(
        Mistake{kReal, "a: {}", "bits: is missing"}, Mistake{kReal, "a: {bits: 9}", "10 to 26"},
        Mistake{kReal, "a: {bits: 27}", "10 to 26"}, Mistake{kReal, "a: {bits: 14, node: 0}", "node: '0'"},
        Mistake{kReal, "a: {bits: 14, node: 256}", "node: '256'"},
        Mistake{kReal, "a: {bits: 14, period_ms: 30, set_period: true}", "1000 divided by 1 to 255"},
        Mistake{kReal, "a: {bits: 14, mode: single, period_ms: 30}", "of mode cyclic only"},
        Mistake{kReal, "a: {bits: 14, timeout_us: 3000}", "of mode single only"},
        Mistake{kReal, "a: {bits: 14, positive_byte: 1, negative_byte: 1}", "the two directions need two bytes"},
        Mistake{kReal, "a: {bits: 14}, b: {bits: 14}", "0x120 is that of a (node 0x20) too"},
        Mistake{kReal, "a: {bits: 14, node: 0x85}, b: {model: cia406, bits: 12, node: 5}", "0x185 is that of a"},
        Mistake{"bench: true, link: {iface: can0}, ", "a: {bits: 14}, b: {bits: 14, node: 1}", "alone on its bus"},
        Mistake{"bench: true, link: {iface: can0}, ", "a: {model: cia406, bits: 12, node: 5}", "alone on its bus"},
        Mistake{kReal, "a: {bits: 14, period_ms: 1}, b: {bits: 14, node: 1, period_ms: 1}", "108 % of the wire"},
        Mistake{"link: {iface: /dev/can}, ", "a: {bits: 14}", "no name of an interface"},
        Mistake{kReal, "a: {bits: 14, model: saa99}", "is not one of saa"}));

}  // namespace
}  // namespace axlecast::saa_can
