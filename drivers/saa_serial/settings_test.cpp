#include "drivers/saa_serial/settings.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <array>

#include "core/device/operation.h"
#include "drivers/saa/table_test_support.h"
#include "drivers/saa_serial/machine_test_support.h"

namespace axlecast {

const Family& saa_serial_family();

// The family table of this test program: cmake/axlecast.cmake makes that of the others.
std::span<const Family* const> Families() {
  static const std::array<const Family*, 1> kFamilies = {&saa_serial_family()};
  return kFamilies;
}

namespace saa_serial {
namespace {

using ::testing::HasSubstr;

const std::string kLink = "link: {port: /dev/ttyX, baud: 115200}";
const std::string kTiming = kLink + ", mode: timing, refresh_hz: 500";
const std::string kHandshake = kLink + ", mode: handshake, lines: {clk: {chip: /dev/gpiochip0, line: 5}}";
const std::string kBus = kLink + ", mode: bus";
const std::string kDevice = "a: {bits: 14}";
const std::string kBusDevice = "a: {bits: 14, address: 1}";

TEST(SaaSettings, Timing) {
  const MachineConfig machine = LoadMachine(kTiming, "a: {bits: 17, model: saa58p24}");
  const SaaBus& bus = OwnBus(machine.buses.at(0));
  EXPECT_EQ(bus.mode, Mode::kTiming);
  EXPECT_EQ(bus.refresh, 2 * kMillisecond);
  EXPECT_FALSE(bus.zero_clearing);
  EXPECT_TRUE(bus.lines.empty());
  const SaaSettings& settings = Own(machine.buses[0].devices.at(0));
  EXPECT_EQ(settings.model, "saa58p24");
  EXPECT_EQ(settings.counts_per_turn, 131'072);
  EXPECT_EQ(settings.turns_range, 0) << "4.1: single-turn";
  EXPECT_EQ(settings.max_speed_rpm, 5'000) << "4.2";
  EXPECT_EQ(settings.processing, 2 * kMillisecond) << "one period: the manual gives no T3";
  EXPECT_EQ(settings.wire_time, 2 * kMillisecond) << "a reading comes once a period";
}

TEST(SaaSettings, HandshakeWithZeroClearing) {
  const MachineConfig machine = LoadMachine(
      kLink +
          ", mode: handshake, lines: {clk: {chip: /dev/gpiochip0, line: 5}, clr: {chip: /dev/gpiochip1, line: 6, "
          "low_us: 500}}",
      kDevice);
  const SaaBus& bus = OwnBus(machine.buses.at(0));
  ASSERT_EQ(bus.lines.size(), 2U);
  EXPECT_EQ(bus.lines.at(bus.clk->index).name, "clk");
  EXPECT_EQ(bus.lines.at(bus.clk->index).offset, 5);
  EXPECT_EQ(bus.lines.at(bus.clr->index).chip, "/dev/gpiochip1");
  EXPECT_GE(bus.clk->low, 10 * kMicrosecond) << "5.1.3: T2 >= 10 us";
  EXPECT_EQ(bus.clr->low, 500 * kMicrosecond);
  EXPECT_TRUE(bus.zero_clearing);
}

TEST(SaaSettings, PolledBusWithZeroClearing) {
  const MachineConfig machine =
      LoadMachine(kBus + ", zero_clearing: true",
                  "a: {bits: 14, address: 1}, b: {bits: 20, address: 0xB2, reply_header: address},"
                  "c: {bits: 26, address: 0x33, zero_command: 0x44, reply_header: 81}");
  const auto& devices = machine.buses.at(0).devices;
  EXPECT_EQ(Own(devices[0]).format.address, 0xB1);
  EXPECT_EQ(Own(devices[0]).zero_command, 0xC1) << "5.1.6 (1): the X of CX is that of BX";
  EXPECT_EQ(Own(devices[0]).format.header, ReplyHeader::kEither);
  EXPECT_EQ(Own(devices[1]).zero_command, 0xC2);
  EXPECT_EQ(Own(devices[1]).format.header, ReplyHeader::kAddress);
  EXPECT_EQ(Own(devices[2]).format.address, 0x33);
  EXPECT_EQ(Own(devices[2]).zero_command, 0x44);
  EXPECT_EQ(Own(devices[2]).format.header, ReplyHeader::kFixed);
}

// "Odd Parity Check and even parity check are optional" (5): one bit more in each character.
TEST(SaaSettings, ParityCountsOnTheWire) {
  for (const auto& [parity, bits] : {std::pair{"none", 10}, {"odd", 11}, {"even", 11}}) {
    const MachineConfig machine = LoadMachine(
        "link: {port: /dev/ttyX, baud: 9600, parity: " + std::string(parity) + "}, mode: bus", kBusDevice);
    EXPECT_EQ(Own(machine.buses.at(0).devices.at(0)).wire_time, 8 * bits * kSecond / 9'600) << parity;
    EXPECT_EQ(Own(machine.buses.at(0).devices.at(0)).latch_after, 3 * bits * kSecond / 9'600) << "the request";
  }
}

// 4.1, every column of the table, in counts.
TEST(SaaSettings, TheNoiseIsTwiceTheAccuracyOfTheTable) {
  const auto noise = [](int bits) {
    const MachineConfig machine = LoadMachine(kTiming, "a: {bits: " + std::to_string(bits) + "}");
    return Own(machine.buses.at(0).devices.at(0)).noise_counts;
  };
  for (const saa::TableColumn& column : saa::kTable41) EXPECT_EQ(noise(column.bits), column.noise) << column.bits;
  for (int bits = 10; bits < 16; ++bits) EXPECT_EQ(noise(bits), 1) << "the table gives none";
}

struct Mistake {
  std::string keys;
  std::string devices;
  std::string said;
};

class SaaMistake : public ::testing::TestWithParam<Mistake> {};

TEST_P(SaaMistake, IsRefusedWithItsReason) {
  EXPECT_THAT(ProblemOf(GetParam().keys, GetParam().devices), HasSubstr(GetParam().said));
}

INSTANTIATE_TEST_SUITE_P(
    Each, SaaMistake,
    ::testing::Values(
        Mistake{kLink, kDevice, "mode: is missing"},
        Mistake{"link: {port: /dev/ttyX}, mode: bus", kBusDevice, "needs baud"},
        Mistake{kLink + ", mode: timing", kDevice, "refresh_hz: is missing"},
        Mistake{kTiming + ", poll_hz: 100", kDevice, "the encoder sends at refresh_hz"},
        Mistake{kBus + ", refresh_hz: 100", kBusDevice, "is of mode timing only"},
        Mistake{kLink + ", mode: handshake", kDevice, "clk: is missing"},
        Mistake{kTiming + ", lines: {clk: {chip: /dev/gpiochip0, line: 1}}", kDevice,
                "only mode handshake has a CLK"},
        Mistake{kBus + ", lines: {clr: {chip: /dev/gpiochip0, line: 1}}", kBusDevice,
                "zero_clearing: true instead"},
        Mistake{kTiming + ", lines: {clr: rts}", kDevice, "opening the port toggles them, which on CLR would zero"},
        Mistake{kTiming + ", lines: {clr: DTR}", kDevice, "would zero the machine"},
        Mistake{kTiming + ", lines: {clr: {chip: /dev/ttyX, line: rts}}", kDevice, "would zero the machine"},
        Mistake{kBus + ", lines: {clr: rts}", kBusDevice, "would zero the machine"},
        Mistake{kLink + ", mode: handshake, lines: {clk: dtr}", kDevice, "RTS and DTR cannot be used"},
        Mistake{kTiming + ", lines: {clr: {chip: /dev/ttyX, line: 1}}", kDevice, "is no GPIO chip"},
        Mistake{kTiming + ", lines: {clr: {chip: /dev/gpiochip0}}", kDevice, "and line are needed"},
        Mistake{kLink + ", mode: handshake, lines: {clk: {chip: /dev/gpiochip0, line: 5, low_us: 9}}", kDevice,
                "T2 >= 10 us"},
        Mistake{kLink +
                    ", mode: handshake, lines: {clk: {chip: /dev/gpiochip0, line: 5}, clr: {chip: /dev/gpiochip0,"
                    " line: 5}}",
                kDevice, "the same line as clk"},
        Mistake{kTiming + ", zero_clearing: true", kDevice, "zero_clearing: is of mode bus only"},
        Mistake{kTiming, "a: {}", "bits: is missing"}, Mistake{kTiming, "a: {bits: 9}", "10 to 26"},
        Mistake{kTiming, "a: {bits: 27}", "10 to 26"},
        Mistake{kTiming, "a: {bits: 14, address: 1}", "address: is of mode bus only"},
        Mistake{kTiming, "a: {bits: 14}, b: {bits: 14}", "one encoder per bus"},
        Mistake{kBus, kDevice, "address: is missing"}, Mistake{kBus, "a: {bits: 14, address: 255}", "0 to 254"},
        Mistake{kBus, "a: {bits: 14, address: 1}, b: {bits: 14, address: 0xB1}", "must be one encoder's alone"},
        Mistake{kBus + ", zero_clearing: true", "a: {bits: 14, address: 1}, b: {bits: 14, address: 0xC1}",
                "b.zero_command: is missing"},
        Mistake{kBus + ", zero_clearing: true",
                "a: {bits: 14, address: 1}, b: {bits: 14, address: 0xC1, zero_command: 2}",
                "BC AA C1 is the control command of b and the zero clearing command of a"},
        Mistake{kBus, "a: {bits: 14, address: 1, zero_command: 1}", "needs zero_clearing: true"},
        Mistake{kLink + ", mode: timing, refresh_hz: 3000", kDevice, "longer than the period of refresh_hz"}));

TEST(SaaSettings, UpToSixteenOnAPolledBus) {
  std::string devices;
  for (int i = 0; i < 16; ++i) {
    devices += "d" + std::to_string(i) + ": {bits: 14, address: " + std::to_string(i) + "}, ";
  }
  EXPECT_EQ(ProblemOf(kBus, devices), "");
  EXPECT_THAT(ProblemOf(kBus, devices + "x: {bits: 14, address: 0x99}"), HasSubstr("at most 16"));
}

TEST(SaaSettings, ASimulatedLineNeedsNoChip) {
  EXPECT_EQ(ProblemOf("simulate: true, link: {baud: 9600}, mode: handshake, lines: {clk: {}, clr: {}}", kDevice),
            "");
}

}  // namespace
}  // namespace saa_serial
}  // namespace axlecast
