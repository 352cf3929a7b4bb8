#include "drivers/hal/spi_port.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/stat.h>
#include <unistd.h>

#include <array>
#include <fstream>

#include "platform/os/system_clock.h"
#include "tests/support/temporary_folder.h"

namespace axlecast {
namespace {

using ::testing::HasSubstr;
using Status = Link::Status;

// No build machine has an SPI controller: what one does is shown in tests/vm/spi_port_test.cpp.
class SpiPortTest : public ::testing::Test {
 protected:
  [[nodiscard]] std::string Problem(const std::string& path) {
    SpiPort port(path, {.mode = 2, .clock_hz = 400'000}, clock_);
    std::string problem = ErrorText(port.Open());
    EXPECT_FALSE(port.IsOpen());
    EXPECT_THAT(problem, HasSubstr(path));
    return problem;
  }

  SystemClock clock_;
  const TemporaryFolder folder_;
};

TEST_F(SpiPortTest, ADeviceThatDoesNotExistIsNamedWithTheRemedy) {
  const std::string problem = Problem(folder_.path() + "/spidev7.0");
  EXPECT_THAT(problem, HasSubstr("does not exist"));
  EXPECT_THAT(problem, HasSubstr("dtparam=spi=on"));
  EXPECT_THAT(problem, HasSubstr("ls /dev/spidev*"));
}

TEST_F(SpiPortTest, WhatIsNoSpiDeviceIsNamed) {
  const std::string file = folder_.path() + "/file";
  std::ofstream(file) << "text";
  const std::string fifo = folder_.path() + "/fifo";
  ASSERT_EQ(mkfifo(fifo.c_str(), 0600), 0);
  for (const std::string& path : {file, fifo, folder_.path(), std::string("/dev/null")}) {
    EXPECT_THAT(Problem(path), HasSubstr("is no SPI device: correct link.spidev"));
  }
}

TEST_F(SpiPortTest, WithoutRightsItNamesTheGroup) {
  const std::string file = folder_.path() + "/spidev0.0";
  std::ofstream(file) << "";
  ASSERT_EQ(chmod(file.c_str(), 0), 0);
  ASSERT_EQ(chmod(folder_.path().c_str(), 0755), 0);
  // Root may open everything: nobody may not.
  const bool root = geteuid() == 0;
  ASSERT_EQ(root ? seteuid(65534) : 0, 0);
  const std::string problem = Problem(file);
  ASSERT_EQ(root ? seteuid(0) : 0, 0);
  EXPECT_THAT(problem, HasSubstr("usermod -aG spi USER"));
}

TEST_F(SpiPortTest, AClosedPortIsLostAndCanBeWaitedOn) {
  SpiPort port("/dev/null", {.mode = 2, .clock_hz = 400'000}, clock_);
  std::array<std::uint8_t, 4> bytes{};
  EXPECT_FALSE(port.Write(bytes));
  EXPECT_EQ(port.Read(bytes, clock_.Now() + 60 * kSecond).status, Status::kLost);
  EXPECT_EQ(port.ReadNow(bytes).status, Status::kLost);
  EXPECT_FALSE(port.SetBaud(1));
  EXPECT_EQ(port.Wait(clock_.Now() + kMillisecond), Status::kTimeout);
  port.Wake();
  EXPECT_EQ(port.Wait(clock_.Now() + 60 * kSecond), Status::kWoken);
}

}  // namespace
}  // namespace axlecast
