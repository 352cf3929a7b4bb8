#include "drivers/hal/pulse_lines.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <poll.h>
#include <sys/stat.h>

#include <array>
#include <cstdlib>
#include <filesystem>

#include "platform/net/unix_address.h"
#include "platform/os/system_clock.h"
#include "tests/support/temporary_folder.h"

namespace axlecast {
namespace {

using ::testing::HasSubstr;

class SimulatedLinesTest : public ::testing::Test {
 protected:
  SimulatedLinesTest() { path_ = directory_ + "/b0.lines"; }

  SystemClock clock_;
  const TemporaryFolder folder_;
  const std::string directory_ = folder_.path();
  std::string path_;
};

TEST_F(SimulatedLinesTest, EveryPulseArrivesInOrderOnceItIsOver) {
  SimulatedLinesPort port;
  ASSERT_EQ(port.Listen(path_), "");
  EXPECT_FALSE(port.Next().has_value());
  SimulatedLines lines(path_, clock_);
  ASSERT_EQ(lines.Open(), "");
  const MonoNs start = clock_.Now();
  ASSERT_TRUE(lines.Pulse(0, 0));
  ASSERT_TRUE(lines.Pulse(255, 300 * kMicrosecond));
  EXPECT_GE(clock_.Now() - start, 300 * kMicrosecond) << "low for as long as asked";
  ASSERT_TRUE(lines.Pulse(1, 77'777));

  pollfd readable{port.FileDescriptor(), POLLIN, 0};
  EXPECT_EQ(poll(&readable, 1, 1'000), 1);
  for (const Pulse& expected : {Pulse{0, 0}, Pulse{255, 300 * kMicrosecond}, Pulse{1, 77'777}}) {
    const std::optional<Pulse> pulse = port.Next();
    ASSERT_TRUE(pulse.has_value());
    EXPECT_EQ(pulse->line, expected.line);
    EXPECT_EQ(pulse->low, expected.low);
  }
  EXPECT_FALSE(port.Next().has_value());
}

TEST_F(SimulatedLinesTest, WithoutASimulatorItTellsWhatToDo) {
  SimulatedLines lines(path_, clock_);
  EXPECT_FALSE(lines.Pulse(0, 0)) << "not opened";
  EXPECT_THAT(lines.Open(), HasSubstr("start it with `axlecast simulate`"));
  EXPECT_THAT(SimulatedLines(std::string(200, 'x'), clock_).Open(), HasSubstr("AXLECAST_RUN_DIR"));
}

TEST_F(SimulatedLinesTest, FindsASimulatorThatWasStartedAnew) {
  SimulatedLines lines(path_, clock_);
  {
    SimulatedLinesPort first;
    ASSERT_EQ(first.Listen(path_), "");
    ASSERT_EQ(lines.Open(), "");
  }
  EXPECT_FALSE(std::filesystem::exists(path_));
  EXPECT_FALSE(lines.Pulse(1, 0));
  SimulatedLinesPort second;
  ASSERT_EQ(second.Listen(path_), "");
  EXPECT_TRUE(lines.Pulse(2, 0));
  ASSERT_TRUE(second.Next().has_value());
  lines.Close();
  EXPECT_FALSE(lines.Pulse(3, 0));
}

TEST_F(SimulatedLinesTest, TakesAPathOverAndKeepsOthersOut) {
  {
    SimulatedLinesPort killed;
    ASSERT_EQ(killed.Listen(path_), "");
    std::filesystem::create_hard_link(path_, path_ + ".kept");
  }
  std::filesystem::rename(path_ + ".kept", path_);  // what a killed process leaves behind
  SimulatedLinesPort port;
  ASSERT_EQ(port.Listen(path_), "");
  struct stat status {};
  ASSERT_EQ(stat(path_.c_str(), &status), 0);
  EXPECT_EQ(status.st_mode & 0777U, 0600U);
  SimulatedLinesPort nowhere;
  EXPECT_THAT(nowhere.Listen(directory_ + "/absent/b0.lines"), HasSubstr("No such file"));
}

TEST_F(SimulatedLinesTest, NonsenseIsDropped) {
  SimulatedLinesPort port;
  ASSERT_EQ(port.Listen(path_), "");
  const std::optional<UnixAddress> address = UnixAddress::Of(path_);
  ASSERT_TRUE(address.has_value());
  const Descriptor stranger(socket(AF_UNIX, SOCK_DGRAM | SOCK_CLOEXEC, 0));
  std::array<std::uint8_t, 100> bytes{};
  bytes.fill(0xFF);
  for (const std::size_t size : {0U, 1U, 8U, 9U, 10U, 100U}) {  // of 9 bytes: a negative length
    ASSERT_EQ(sendto(stranger.get(), bytes.data(), size, 0, address->generic(), UnixAddress::size()),
              static_cast<ssize_t>(size));
  }
  SimulatedLines lines(path_, clock_);
  ASSERT_EQ(lines.Open(), "");
  ASSERT_TRUE(lines.Pulse(7, 1));
  const std::optional<Pulse> pulse = port.Next();
  ASSERT_TRUE(pulse.has_value());
  EXPECT_EQ(pulse->line, 7);
  EXPECT_FALSE(port.Next().has_value());
}

}  // namespace
}  // namespace axlecast
