#include <gmock/gmock.h>
#include <gpiod.h>
#include <gtest/gtest.h>
#include <poll.h>
#include <sys/stat.h>
#include <array>
#include <cerrno>
#include <cstdlib>
#include <filesystem>
#include <map>
#include <string>
#include <string_view>

#include "core/device/link.h"
#include "drivers/hal/pulse_lines.h"
#include "platform/net/unix_address.h"
#include "platform/os/system_clock.h"
#include "tests/support/temporary_folder.h"

namespace axlecast {

// No build machine has GPIO lines, nor the kernel's gpio-sim: the functions below replace libgpiod,
// which the linker prefers. They keep to gpiod.h (1.6); what a controller does with its pins is not tested here.

namespace {

using ::testing::AllOf;
using ::testing::ElementsAre;
using ::testing::EndsWith;
using ::testing::HasSubstr;
using ::testing::IsEmpty;

// What the fake kernel holds, and what was done to it.
struct Board {
  struct Line {
    std::string consumer;  // empty: free
    bool high = false;
  };
  struct Change {
    unsigned line;
    bool high;
    MonoNs at;
  };

  std::map<unsigned, Line> lines = {{4, {}}, {17, {}}, {18, {"other-tool", false}}};
  std::vector<Change> changes;
  const Clock* clock = nullptr;
  int open_chips = 0;
  bool refuses_low = false;
};
Board board;

// Advances by 1 us at every read.
class TickingClock final : public Clock {
 public:
  [[nodiscard]] MonoNs Now() const override { return now_ += kMicrosecond; }
  [[nodiscard]] std::int64_t UtcMicroseconds() const override { return 0; }

 private:
  mutable MonoNs now_ = 0;
};

}  // namespace
}  // namespace axlecast

struct gpiod_chip {};
struct gpiod_line {
  unsigned offset = 0;
};

namespace axlecast {
namespace {

gpiod_chip the_chip;
std::map<unsigned, gpiod_line> handles;

}  // namespace
}  // namespace axlecast

using axlecast::board;

extern "C" {

gpiod_chip* gpiod_chip_open(const char* path) {
  const std::string_view name = path;
  if (name == "/dev/gpiochip0") {
    ++board.open_chips;
    return &axlecast::the_chip;
  }
  errno = name == "/dev/gpiochip1" ? EACCES : name == "/dev/null" ? ENOTTY : ENOENT;
  return nullptr;
}

void gpiod_chip_close(gpiod_chip*) { --board.open_chips; }

unsigned gpiod_chip_num_lines(gpiod_chip*) { return 32; }

gpiod_line* gpiod_chip_get_line(gpiod_chip*, unsigned offset) {
  if (offset >= 32) {
    errno = EINVAL;
    return nullptr;
  }
  axlecast::handles[offset].offset = offset;
  return &axlecast::handles[offset];
}

int gpiod_line_request_output(gpiod_line* line, const char* consumer, int value) {
  if (!board.lines[line->offset].consumer.empty()) {
    errno = EBUSY;
    return -1;
  }
  board.lines[line->offset] = {consumer, value != 0};
  return 0;
}

void gpiod_line_release(gpiod_line* line) { board.lines[line->offset].consumer.clear(); }

int gpiod_line_set_value(gpiod_line* line, int value) {
  if (board.lines[line->offset].consumer != "axlecast" || (board.refuses_low && value == 0)) {
    errno = EPERM;
    return -1;
  }
  board.lines[line->offset].high = value != 0;
  board.changes.push_back({line->offset, value != 0, board.clock->Now()});
  return 0;
}

int gpiod_line_update(gpiod_line*) { return 0; }

const char* gpiod_line_consumer(gpiod_line* line) {
  const std::string& consumer = board.lines[line->offset].consumer;
  return consumer.empty() ? nullptr : consumer.c_str();
}

}  // extern "C"

namespace axlecast {
namespace {

class GpioLinesTest : public ::testing::Test {
 protected:
  GpioLinesTest() {
    board = Board();
    board.clock = &clock_;
  }

  static PulseLineConfig Clk() { return {"clk", "/dev/gpiochip0", 4}; }
  static PulseLineConfig Clr() { return {"clr", "/dev/gpiochip0", 17}; }
  std::string Problem(const PulseLineConfig& line) { return ErrorText(GpioLines({line}, clock_).Open()); }

  TickingClock clock_;
};

TEST_F(GpioLinesTest, ClaimsItsLinesHighAndGivesThemBack) {
  {
    GpioLines lines({Clk(), Clr()}, clock_);
    EXPECT_EQ(board.lines[4].consumer, "");
    ASSERT_EQ(ErrorText(lines.Open()), "");
    EXPECT_EQ(board.lines[4].consumer, "axlecast");
    EXPECT_EQ(board.lines[17].consumer, "axlecast");
    EXPECT_TRUE(board.lines[4].high && board.lines[17].high);
    ASSERT_EQ(ErrorText(lines.Open()), "") << "again";
    lines.Close();
    EXPECT_EQ(board.lines[4].consumer, "");
    EXPECT_EQ(board.open_chips, 0);
    ASSERT_EQ(ErrorText(lines.Open()), "");
  }
  EXPECT_EQ(board.lines[17].consumer, "");
  EXPECT_EQ(board.open_chips, 0);
  EXPECT_THAT(board.changes, IsEmpty()) << "claiming makes no edge";
}

TEST_F(GpioLinesTest, APulseIsLowForAtLeastAsLongAsAskedAndThenHigh) {
  GpioLines lines({Clk(), Clr()}, clock_);
  ASSERT_EQ(ErrorText(lines.Open()), "");
  for (const MonoNs low : {MonoNs{0}, 10 * kMicrosecond, 99 * kMicrosecond}) {
    board.changes.clear();
    ASSERT_TRUE(lines.Pulse(1, low));
    ASSERT_EQ(board.changes.size(), 2U);
    EXPECT_EQ(board.changes[0].line, 17U);
    EXPECT_FALSE(board.changes[0].high);
    EXPECT_EQ(board.changes[1].line, 17U);
    EXPECT_TRUE(board.changes[1].high);
    EXPECT_GE(board.changes[1].at - board.changes[0].at, low);
    EXPECT_LE(board.changes[1].at - board.changes[0].at, low + 5 * kMicrosecond);
  }
  EXPECT_TRUE(board.lines[4].high) << "the other line stays as it is";
}

TEST_F(GpioLinesTest, ALongPulseToo) {
  const SystemClock real;
  board.clock = &real;
  GpioLines lines({Clk()}, real);
  ASSERT_EQ(ErrorText(lines.Open()), "");
  ASSERT_TRUE(lines.Pulse(0, 2 * kMillisecond));
  EXPECT_GE(board.changes[1].at - board.changes[0].at, 2 * kMillisecond);
}

TEST_F(GpioLinesTest, NoPulseWithoutItsLine) {
  GpioLines lines({Clk()}, clock_);
  EXPECT_FALSE(lines.Pulse(0, 0)) << "not open";
  ASSERT_EQ(ErrorText(lines.Open()), "");
  EXPECT_FALSE(lines.Pulse(1, 0));
  EXPECT_TRUE(lines.Pulse(0, 0));
  board.changes.clear();
  board.refuses_low = true;
  EXPECT_FALSE(lines.Pulse(0, 0)) << "it did not go low";
  EXPECT_TRUE(board.lines[4].high);
}

TEST_F(GpioLinesTest, NamesTheLineTheCauseAndTheRemedy) {
  EXPECT_THAT(
      Problem({"clr", "/dev/gpiochip0", 18}),
      AllOf(HasSubstr("line clr (/dev/gpiochip0 18)"), HasSubstr(", taken by 'other-tool'"), EndsWith(kLineHeld)));
  EXPECT_THAT(Problem({"clr", "/dev/gpiochip0", 32}), AllOf(HasSubstr("lines 0 to 31"), HasSubstr("gpioinfo")));
  EXPECT_THAT(Problem({"clr", "/dev/gpiochip0", -1}), HasSubstr("lines 0 to 31"));
  EXPECT_THAT(Problem({"clr", "/dev/gpiochip1", 0}),
              AllOf(HasSubstr("line clr (/dev/gpiochip1 0)"), HasSubstr("usermod -aG gpio")));
  EXPECT_THAT(Problem({"clr", "/dev/gpiochip9", 0}), HasSubstr("gpiodetect"));
  EXPECT_THAT(Problem({"clr", "/dev/null", 0}), HasSubstr("no GPIO chip"));
}

TEST_F(GpioLinesTest, ClaimsAllOrNone) {
  GpioLines lines({Clk(), {"clr", "/dev/gpiochip0", 18}}, clock_);
  EXPECT_THAT(ErrorText(lines.Open()), EndsWith(kLineHeld));
  EXPECT_EQ(board.lines[4].consumer, "");
  EXPECT_EQ(board.lines[18].consumer, "other-tool");
  EXPECT_EQ(board.open_chips, 0);
  EXPECT_FALSE(lines.Pulse(0, 0));
}

}  // namespace

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
  ASSERT_EQ(ErrorText(port.Listen(path_)), "");
  EXPECT_FALSE(port.Next().has_value());
  SimulatedLines lines(path_, clock_);
  ASSERT_EQ(ErrorText(lines.Open()), "");
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
  EXPECT_THAT(ErrorText(lines.Open()), HasSubstr("start it with `axlecast simulate`"));
  EXPECT_THAT(ErrorText(SimulatedLines(std::string(200, 'x'), clock_).Open()), HasSubstr("AXLECAST_RUN_DIR"));
}

TEST_F(SimulatedLinesTest, FindsASimulatorThatWasStartedAnew) {
  SimulatedLines lines(path_, clock_);
  {
    SimulatedLinesPort first;
    ASSERT_EQ(ErrorText(first.Listen(path_)), "");
    ASSERT_EQ(ErrorText(lines.Open()), "");
  }
  EXPECT_FALSE(std::filesystem::exists(path_));
  EXPECT_FALSE(lines.Pulse(1, 0));
  SimulatedLinesPort second;
  ASSERT_EQ(ErrorText(second.Listen(path_)), "");
  EXPECT_TRUE(lines.Pulse(2, 0));
  ASSERT_TRUE(second.Next().has_value());
  lines.Close();
  EXPECT_FALSE(lines.Pulse(3, 0));
}

TEST_F(SimulatedLinesTest, TakesAPathOverAndKeepsOthersOut) {
  {
    SimulatedLinesPort killed;
    ASSERT_EQ(ErrorText(killed.Listen(path_)), "");
    std::filesystem::create_hard_link(path_, path_ + ".kept");
  }
  std::filesystem::rename(path_ + ".kept", path_);  // what a killed process leaves behind
  SimulatedLinesPort port;
  ASSERT_EQ(ErrorText(port.Listen(path_)), "");
  struct stat status {};
  ASSERT_EQ(stat(path_.c_str(), &status), 0);
  EXPECT_EQ(status.st_mode & 0777U, 0600U);
  SimulatedLinesPort nowhere;
  EXPECT_THAT(ErrorText(nowhere.Listen(directory_ + "/absent/b0.lines")), HasSubstr("No such file"));
}

TEST_F(SimulatedLinesTest, NonsenseIsDropped) {
  SimulatedLinesPort port;
  ASSERT_EQ(ErrorText(port.Listen(path_)), "");
  const Result<UnixAddress> address = UnixAddress::Of(path_);
  ASSERT_TRUE(address.has_value());
  const Descriptor stranger(socket(AF_UNIX, SOCK_DGRAM | SOCK_CLOEXEC, 0));
  std::array<std::uint8_t, 100> bytes{};
  bytes.fill(0xFF);
  for (const std::size_t size : {0U, 1U, 8U, 9U, 10U, 100U}) {  // of 9 bytes: a negative length
    ASSERT_EQ(sendto(stranger.get(), bytes.data(), size, 0, address->generic(), UnixAddress::size()),
              static_cast<ssize_t>(size));
  }
  SimulatedLines lines(path_, clock_);
  ASSERT_EQ(ErrorText(lines.Open()), "");
  ASSERT_TRUE(lines.Pulse(7, 1));
  const std::optional<Pulse> pulse = port.Next();
  ASSERT_TRUE(pulse.has_value());
  EXPECT_EQ(pulse->line, 7);
  EXPECT_FALSE(port.Next().has_value());
}

}  // namespace
}  // namespace axlecast
