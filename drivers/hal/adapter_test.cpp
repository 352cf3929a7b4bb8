#include "drivers/hal/adapter.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <string>

#include "tests/support/temporary_folder.h"

namespace axlecast {
namespace {

using ::testing::HasSubstr;

constexpr std::int64_t kTFormat = 2'500'000;
constexpr UsbAdapter kFt232r{0x0403, 0x6001, 0x0600};
constexpr UsbAdapter kFt232bm{0x0403, 0x6001, 0x0400};
constexpr UsbAdapter kFt232h{0x0403, 0x6014, 0x0900};
constexpr UsbAdapter kFt2232h{0x0403, 0x6010, 0x0700};

// FTDI AN120 "Aliasing VCP Baud Rates": 3 Mbaud / n, n = 1, 1.5, then eighths from 2.
TEST(CheckAdapter, FullSpeedFtdiChipsHaveNothingBetweenTwoAndThreeMegabaud) {
  for (const UsbAdapter& adapter : {kFt232r, kFt232bm}) {
    const AdapterVerdict verdict = CheckAdapter(adapter, kTFormat);
    EXPECT_FALSE(verdict.fits);
    EXPECT_THAT(verdict.text, HasSubstr("it cannot do this rate; use one with an FT232H"));
  }
  EXPECT_THAT(CheckAdapter(kFt232r, kTFormat).text, HasSubstr("0403:6001 (FT232R)"));
  EXPECT_DOUBLE_EQ(CheckAdapter(kFt232r, 2'000'000).baud, 2e6);
  EXPECT_TRUE(CheckAdapter(kFt232r, 2'000'000).fits);
  EXPECT_TRUE(CheckAdapter(kFt232r, 3'000'000).fits);
  EXPECT_EQ(CheckAdapter(kFt232r, 9'600).text, "");
  EXPECT_EQ(CheckAdapter(kFt232r, 115'200).text, "");
}

// 12 MHz / 4.75 = 2.526 Mbaud, +1.05 %.
TEST(CheckAdapter, HighSpeedFtdiChipsComeNearEnough) {
  for (const UsbAdapter& adapter : {kFt232h, kFt2232h}) {
    const AdapterVerdict verdict = CheckAdapter(adapter, kTFormat);
    EXPECT_TRUE(verdict.fits);
    EXPECT_NEAR(verdict.baud, 2'526'316, 1);
    EXPECT_THAT(verdict.text, HasSubstr("+1.05 %"));
  }
  EXPECT_EQ(CheckAdapter(kFt232h, 3'000'000).text, "");
  EXPECT_EQ(CheckAdapter(kFt232h, 19'200).text, "");
}

// Silicon Labs AN205 and Linux cp210x: 24 MHz / n. WCH CH340 data sheet: up to 2 Mbaud.
TEST(CheckAdapter, OtherChipsThatCannotDoTheRate) {
  const AdapterVerdict silabs = CheckAdapter({0x10C4, 0xEA60, 0x0100}, kTFormat);
  EXPECT_FALSE(silabs.fits);
  EXPECT_THAT(silabs.text, HasSubstr("2.4 Mbaud"));
  EXPECT_EQ(CheckAdapter({0x10C4, 0xEA60, 0x0100}, 115'200).text, "");
  const AdapterVerdict wch = CheckAdapter({0x1A86, 0x7523, 0x0264}, kTFormat);
  EXPECT_FALSE(wch.fits);
  EXPECT_THAT(wch.text, HasSubstr("2 Mbaud"));
  EXPECT_TRUE(CheckAdapter({0x1A86, 0x7523, 0x0264}, 9'600).fits);
}

TEST(CheckAdapter, AnUnknownChipIsNamedWhereItMatters) {
  const AdapterVerdict verdict = CheckAdapter({0x1234, 0xABCD, 0x0100}, kTFormat);
  EXPECT_TRUE(verdict.fits);
  EXPECT_THAT(verdict.text, HasSubstr("1234:abcd is not known here"));
  EXPECT_EQ(CheckAdapter({0x1234, 0xABCD, 0x0100}, 115'200).text, "");
}

class SysfsTest : public ::testing::Test {
 protected:
  void SetUp() override {
    const std::filesystem::path device = root_ / "devices/usb1/1-2";
    port_ = device / "1-2:1.0/ttyUSB0";
    std::filesystem::create_directories(port_ / "tty/ttyUSB0");
    std::filesystem::create_directories(root_ / "dev/char");
    std::filesystem::create_symlink(port_ / "tty/ttyUSB0", root_ / "dev/char/188:0");
    std::ofstream(device / "idVendor") << "0403\n";
    std::ofstream(device / "idProduct") << "6014\n";
    std::ofstream(device / "bcdDevice") << "0900\n";
    std::ofstream(port_ / "latency_timer") << "16\n";
  }
  const TemporaryFolder folder_;
  const std::filesystem::path root_ = folder_.path();
  std::filesystem::path port_;
};

TEST_F(SysfsTest, FindsTheIdsAndTheTimer) {
  const TtyFacts facts = ReadTtyFacts(root_, 188, 0);
  ASSERT_TRUE(facts.usb);
  EXPECT_EQ(facts.usb->vendor, 0x0403);
  EXPECT_EQ(facts.usb->product, 0x6014);
  EXPECT_EQ(facts.usb->release, 0x0900);
  EXPECT_EQ(facts.latency_timer, port_ / "latency_timer");
}

TEST_F(SysfsTest, APortThatIsNoUsbAdapterHasNeither) {
  EXPECT_FALSE(ReadTtyFacts(root_, 4, 64).usb);
  std::filesystem::create_directories(root_ / "devices/platform/serial8250/tty/ttyS0");
  std::filesystem::create_symlink(root_ / "devices/platform/serial8250/tty/ttyS0", root_ / "dev/char/4:64");
  EXPECT_FALSE(ReadTtyFacts(root_, 4, 64).usb);
  EXPECT_EQ(ReadTtyFacts(root_, 4, 64).latency_timer, "");
  EXPECT_FALSE(ReadTtyFacts("/nowhere", 4, 64).usb);
}

TEST_F(SysfsTest, SetsTheTimerToOneMillisecond) {
  EXPECT_EQ(ErrorText(ShortenLatency(port_ / "latency_timer")), "");
  int value = 0;
  std::ifstream(port_ / "latency_timer") >> value;
  EXPECT_EQ(value, 1);
}

TEST_F(SysfsTest, TellsTheLineWhereItMayNot) {
  const std::filesystem::path timer = port_ / "latency_timer";
  std::filesystem::remove(timer);
  EXPECT_THAT(ErrorText(ShortenLatency(timer / "absent")),
              HasSubstr("echo 1 > /sys/bus/usb-serial/devices/latency_timer/latency_timer"));
  std::filesystem::create_symlink("/proc/sys/kernel/ostype", timer);  // read-only for everybody
  EXPECT_THAT(ErrorText(ShortenLatency(timer)),
              HasSubstr("echo 1 > /sys/bus/usb-serial/devices/ttyUSB0/latency_timer"));
  EXPECT_THAT(ErrorText(ShortenLatency(timer)), HasSubstr("udev"));
}

}  // namespace
}  // namespace axlecast
