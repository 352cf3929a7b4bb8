#include <asm/ioctls.h>
#include <asm/termbits.h>
#include <fcntl.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <poll.h>
#include <stdlib.h>
#include <sys/file.h>
#include <sys/ioctl.h>
#include <sys/socket.h>
#include <sys/stat.h>
#include <sys/sysmacros.h>
#include <sys/un.h>
#include <sys/wait.h>
#include <unistd.h>
#include <array>
#include <cerrno>
#include <csignal>
#include <cstddef>
#include <filesystem>
#include <functional>
#include <string>
#include <utility>
#include <vector>

#include "drivers/hal/line_guard.h"
#include "drivers/hal/modbus_port.h"
#include "drivers/hal/pty.h"
#include "drivers/hal/serial_port.h"
#include "platform/os/system_clock.h"
#include "tests/support/temporary_folder.h"

namespace axlecast {
namespace {

using ::testing::AllOf;
using ::testing::HasSubstr;

// A terminal of another program, as it is made: with echo and line editing.
class Terminal {
 public:
  Terminal() : master_(posix_openpt(O_RDWR | O_NOCTTY | O_NONBLOCK | O_CLOEXEC)) {
    EXPECT_EQ(grantpt(master_.get()), 0);
    EXPECT_EQ(unlockpt(master_.get()), 0);
    std::array<char, 64> name{};
    EXPECT_EQ(ptsname_r(master_.get(), name.data(), name.size()), 0);
    path_ = name.data();
    slave_ = Descriptor(open(path_.c_str(), O_RDWR | O_NOCTTY | O_CLOEXEC));
  }

  [[nodiscard]] const std::string& path() const { return path_; }
  [[nodiscard]] int slave() const { return slave_.get(); }
  [[nodiscard]] termios2 Mode() const {
    termios2 mode{};
    EXPECT_EQ(ioctl(slave_.get(), TCGETS2, &mode), 0);
    return mode;
  }
  // As somebody types a line at it. Returns when it has arrived, and its echo, if there is one, with it.
  void Type(const std::string& line) const {
    constexpr int kLimitMs = 30'000;  // generous: for a host that is busy with something else
    EXPECT_EQ(write(master_.get(), line.data(), line.size()), static_cast<ssize_t>(line.size()));
    pollfd arrived{slave_.get(), POLLIN, 0};
    EXPECT_EQ(poll(&arrived, 1, kLimitMs), 1);
  }
  // What was written at the other end, or echoed.
  [[nodiscard]] std::string Shows() const {
    std::array<char, 256> shown{};
    const ssize_t count = read(master_.get(), shown.data(), shown.size());
    return {shown.data(), count > 0 ? static_cast<std::size_t>(count) : 0};
  }

 private:
  Descriptor master_;
  Descriptor slave_;
  std::string path_;
};

class LineGuardTest : public ::testing::Test {
 protected:
  LineGuardTest() { path_ = folder_.path() + "/bus.pty"; }

  // What a simulator leaves that was killed: its link, to a number that the kernel gives away again. The very link,
  // by a second name of its inode.
  std::string LeaveStaleLink() const {
    Pty killed;
    EXPECT_EQ(ErrorText(killed.Open(path_)), "");
    std::filesystem::create_hard_link(path_, path_ + ".kept");
    killed.Close();
    std::filesystem::rename(path_ + ".kept", path_);
    return std::filesystem::read_symlink(path_);
  }

  // A terminal that has the number of the killed simulator's. The kernel gives the lowest free one; other processes
  // need numbers too, so this is repeated until this process has the number.
  Terminal& TerminalWithStaleNumber() {
    for (int i = 0; i < 100; ++i) {
      const std::string wanted = LeaveStaleLink();
      for (std::size_t tries = terminals_.size() + 3; tries > 0; --tries) {
        if (terminals_.emplace_back().path() == wanted) return terminals_.back();
      }
    }
    ADD_FAILURE() << "no terminal got the number of the simulator's";
    return terminals_.back();
  }

  [[nodiscard]] SerialSettings Settings(PtyStatement statement = {}) const {
    return {.path = path_, .format = {.baud = 9'600}, .pty = statement};
  }

  SystemClock clock_;
  const TemporaryFolder folder_;
  std::string path_;
  std::vector<Terminal> terminals_;
};

// Seen: 0.4 s after a simulator was killed, another program's terminal had its number; the driver that followed the
// link set it to raw mode and wrote its requests into it.
TEST_F(LineGuardTest, ATerminalThatGotTheNumberOfAKilledSimulatorIsLeftAsItIs) {
  const Terminal& terminal = TerminalWithStaleNumber();
  const termios2 before = terminal.Mode();
  for (const PtyStatement statement : {PtyStatement{.simulated = true}, PtyStatement{}}) {
    EXPECT_THAT(ErrorText(SerialPort(Settings(statement), clock_).Open()),
                AllOf(HasSubstr(path_ + " leads to " + terminal.path()),
                      HasSubstr("that no simulator of ours made"), HasSubstr("axlecast simulate")));
    EXPECT_THAT(ErrorText(ModbusPort(Settings(statement), clock_).Open()),
                HasSubstr("that no simulator of ours made"));
  }
  const termios2 after = terminal.Mode();
  EXPECT_EQ(after.c_lflag, before.c_lflag);
  EXPECT_EQ(after.c_iflag, before.c_iflag);
  EXPECT_EQ(after.c_oflag, before.c_oflag);
  EXPECT_EQ(after.c_cflag, before.c_cflag);
  EXPECT_EQ(after.c_ospeed, before.c_ospeed);
  EXPECT_EQ(terminal.Shows(), "");
  EXPECT_EQ(flock(terminal.slave(), LOCK_EX | LOCK_NB), 0) << "nobody holds a lock on it";
}

TEST_F(LineGuardTest, TheLineOfAnotherSimulatorUnderAStaleLinkIsRefused) {
  const std::string number = LeaveStaleLink();
  Pty other;
  for (int i = 0; i < 100; ++i) {
    ASSERT_EQ(ErrorText(other.Open(folder_.path() + "/other.pty")), "");
    if (std::filesystem::read_symlink(folder_.path() + "/other.pty") == number) break;
  }
  std::filesystem::remove(path_);
  std::filesystem::create_symlink(std::filesystem::read_symlink(folder_.path() + "/other.pty"), path_);
  EXPECT_THAT(ErrorText(SerialPort(Settings({.simulated = true}), clock_).Open()),
              HasSubstr("that no simulator of ours made"));
}

TEST_F(LineGuardTest, TheLineOfARunningSimulatorIsTakenByItsLinkAndByALinkToThat) {
  Pty simulator;
  ASSERT_EQ(ErrorText(simulator.Open(path_)), "");
  EXPECT_EQ(ErrorText(SerialPort(Settings(), clock_).Open()), "");
  EXPECT_EQ(ErrorText(SerialPort(Settings({.simulated = true}), clock_).Open()), "");
  EXPECT_EQ(ErrorText(ModbusPort(Settings({.simulated = true}), clock_).Open()), "");
  EXPECT_EQ(ErrorText(SerialPort(Settings({.simulated = true}), clock_).Open()), "")
      << "libmodbus left the mark alone";
  std::filesystem::create_symlink("bus.pty", folder_.path() + "/mine");
  path_ = folder_.path() + "/mine";
  EXPECT_EQ(ErrorText(SerialPort(Settings({.simulated = true}), clock_).Open()), "");
}

TEST_F(LineGuardTest, APtyOfAnotherProgramNeedsAStatement) {
  const Terminal terminal;
  path_ = terminal.path();
  EXPECT_THAT(ErrorText(SerialPort(Settings(), clock_).Open()),
              AllOf(HasSubstr("is a pseudo-terminal that no simulator"), HasSubstr("`pty: true`")));
  EXPECT_NE(terminal.Mode().c_lflag & ECHO, 0U);
  EXPECT_EQ(ErrorText(SerialPort(Settings({.foreign = true}), clock_).Open()), "");
}

// The statement is for the pty of a program. The terminal of a person is always refused.
TEST_F(LineGuardTest, TheControllingTerminalOfASessionIsRefusedEvenSo) {
  const Terminal terminal;
  path_ = terminal.path();
  std::array<int, 2> ready{}, done{};
  ASSERT_EQ(pipe2(ready.data(), O_CLOEXEC), 0);
  ASSERT_EQ(pipe2(done.data(), O_CLOEXEC), 0);
  const pid_t shell = fork();
  if (shell == 0) {
    const bool has = setsid() > 0 && ioctl(terminal.slave(), TIOCSCTTY, 0) == 0;
    close(done[1]);
    char byte = has ? 'y' : 'n';
    static_cast<void>(!write(ready[1], &byte, 1));
    static_cast<void>(!read(done[0], &byte, 1));
    _exit(0);
  }
  ASSERT_GT(shell, 0);
  char has = 'n';
  ASSERT_EQ(read(ready[0], &has, 1), 1);
  ASSERT_EQ(has, 'y');
  const std::string problem = ErrorText(SerialPort(Settings({.foreign = true}), clock_).Open());
  close(done[1]);
  ASSERT_EQ(waitpid(shell, nullptr, 0), shell);
  EXPECT_THAT(problem, AllOf(HasSubstr("is the terminal that "), HasSubstr(", process " + std::to_string(shell)),
                             HasSubstr("correct link.port")));
  EXPECT_NE(terminal.Mode().c_lflag & ECHO, 0U) << "as it was";
  EXPECT_EQ(ErrorText(SerialPort(Settings({.foreign = true}), clock_).Open()), "") << "after the session has ended";
}

TEST_F(LineGuardTest, AConsoleIsRefused) {
  int refused = 0;
  for (const char* console : {"/dev/tty", "/dev/console", "/dev/ptmx", "/dev/tty1"}) {
    struct stat status {};
    if (stat(console, &status) != 0 || IsPtyDevice(status.st_rdev)) continue;  // a container's console is a pty
    path_ = console;
    EXPECT_THAT(ErrorText(SerialPort(Settings({.foreign = true}), clock_).Open()),
                HasSubstr("is a console and no serial port"));
    ++refused;
  }
  EXPECT_GT(refused, 0) << "every host has /dev/tty";
}

// The numbers of Documentation/admin-guide/devices.txt, whatever this host has.
TEST(LineGuard, KnowsAConsoleByItsDeviceNumber) {
  struct Device {
    const char* name;
    unsigned major;
    unsigned minor;
    bool console;
  };
  for (const Device& device : {Device{"tty0", 4, 0, true},
                               {"tty1", 4, 1, true},
                               {"tty63", 4, 63, true},
                               {"ttyS0", 4, 64, false},
                               {"ttyS191", 4, 255, false},
                               {"tty", 5, 0, true},
                               {"console", 5, 1, true},
                               {"ptmx", 5, 2, true},
                               {"cua0", 5, 64, false},
                               {"ttyUSB0", 188, 0, false},
                               {"ttyACM0", 166, 0, false},
                               {"ttyAMA0", 204, 64, false},
                               {"pts/0", 136, 0, false},
                               {"pts/1048575", 143, 1048575 - 7 * 256, false}}) {
    EXPECT_EQ(IsConsoleDevice(makedev(device.major, device.minor)), device.console) << device.name;
  }
}

// Until the mode was set, the echo of the line sent everything back that arrived, for as long as the adapter was
// looked at: milliseconds.
TEST_F(LineGuardTest, ALineIsRawAsSoonAsItIsClaimedAndBeforeItIsLocked) {
  const Terminal terminal;
  path_ = terminal.path();
  Tty tty(Settings({.foreign = true}), clock_);
  ASSERT_EQ(ErrorText(tty.Claim()), "");
  EXPECT_EQ(terminal.Mode().c_lflag, 0U) << "no echo, no line editing";
  terminal.Type("\x1A\x03hello\r");
  EXPECT_EQ(terminal.Shows(), "");

  const Terminal held;
  path_ = held.path();
  ASSERT_EQ(flock(held.slave(), LOCK_EX | LOCK_NB), 0);
  Tty second(Settings({.foreign = true}), clock_);
  EXPECT_THAT(ErrorText(second.Claim()), HasSubstr("another process holds it"));
  held.Type("hello\r");
  EXPECT_EQ(held.Shows(), "");
}

// libmodbus gives a line back in the mode in which it found it: with echo, in the middle of a change of rate.
TEST_F(LineGuardTest, ALineStaysRawWhenLibmodbusClosesIt) {
  const Terminal terminal;
  path_ = terminal.path();
  {
    ModbusPort port(Settings({.foreign = true}), clock_);
    ASSERT_EQ(ErrorText(port.Open()), "");
    ASSERT_TRUE(port.SetBaud(19'200));
  }
  terminal.Type("hello\r");
  EXPECT_EQ(terminal.Shows(), "");
}

TEST_F(LineGuardTest, ASimulatorsLineIsRawBeforeAHostOpensIt) {
  Pty simulator;
  ASSERT_EQ(ErrorText(simulator.Open(path_)), "");
  const Descriptor host(open(path_.c_str(), O_RDWR | O_NOCTTY | O_CLOEXEC));
  ASSERT_TRUE(simulator.Write(std::array<std::uint8_t, 3>{'a', 3, '\r'}));
  std::array<std::uint8_t, 8> echoed{};
  EXPECT_EQ(simulator.Read(echoed), 0U);
}

TEST(PtyMark, BelongsToTheTerminalAndItsLinkAlone) {
  const TemporaryFolder folder;
  const std::string first = folder.path() + "/first";
  Pty simulator;
  ASSERT_EQ(ErrorText(simulator.Open(first)), "");
  const std::uint64_t mark = MarkOfLink(first);
  EXPECT_NE(mark, 0U);
  EXPECT_EQ(ReadMark(simulator.FileDescriptor()), mark);
  std::filesystem::create_symlink(std::filesystem::read_symlink(first), folder.path() + "/second");
  EXPECT_NE(MarkOfLink(folder.path() + "/second"), mark);
  ASSERT_EQ(ErrorText(simulator.Open(first)), "");
  EXPECT_NE(MarkOfLink(first), mark);
  EXPECT_EQ(MarkOfLink("/dev/null"), 0U);
  EXPECT_EQ(MarkOfLink(folder.path() + "/absent"), 0U);
  const Terminal terminal;
  EXPECT_EQ(ReadMark(terminal.slave()), 0U);
}

// A process that has taken something, until it goes.
class Other {
 public:
  explicit Other(const std::function<bool()>& take) {
    std::array<int, 2> ready{};
    EXPECT_EQ(pipe(ready.data()), 0);
    id_ = fork();
    if (id_ == 0) {
      const char done = take() ? 'y' : 'n';
      static_cast<void>(!write(ready[1], &done, 1));
      for (;;) pause();
    }
    close(ready[1]);
    char done = 'n';
    EXPECT_EQ(read(ready[0], &done, 1), 1);
    EXPECT_EQ(done, 'y');
    close(ready[0]);
  }
  ~Other() {
    kill(id_, SIGKILL);
    waitpid(id_, nullptr, 0);
  }
  Other(const Other&) = delete;
  Other& operator=(const Other&) = delete;

  [[nodiscard]] std::string Process() const { return ", process " + std::to_string(id_); }

 private:
  pid_t id_ = -1;
};

bool Bind(const std::string& name) {
  sockaddr_un address{};
  address.sun_family = AF_UNIX;
  name.copy(&address.sun_path[1], sizeof address.sun_path - 1);
  const int socket_fd = socket(AF_UNIX, SOCK_DGRAM | SOCK_CLOEXEC, 0);
  const auto size = static_cast<socklen_t>(offsetof(sockaddr_un, sun_path) + 1 + name.size());
  return bind(socket_fd, reinterpret_cast<const sockaddr*>(&address), size) == 0;
}

TEST(PortHolder, NamesTheProcessThatHasADeviceOpen) {
  EXPECT_EQ(PortHolder("/nonexistent/port"), "");
  EXPECT_EQ(PortHolder("/etc/hostname"), "") << "no device";
  const int terminal = posix_openpt(O_RDWR | O_NOCTTY | O_CLOEXEC);
  ASSERT_GE(terminal, 0);
  ASSERT_EQ(unlockpt(terminal), 0);
  const std::string path = ptsname(terminal);
  EXPECT_EQ(PortHolder(path), "");
  const Other other([&path] { return open(path.c_str(), O_RDWR | O_NOCTTY) >= 0; });
  const std::string holder = PortHolder(path);
  EXPECT_TRUE(holder.ends_with(other.Process())) << holder;
  EXPECT_FALSE(holder.starts_with(',')) << "with its name";
  close(terminal);
}

TEST(PortHolder, NamesTheProcessThatDrivesACanInterface) {
  const std::string interface = "can" + std::to_string(getpid());
  EXPECT_EQ(PortHolder(interface), "");
  const Other other([&interface] { return Bind(CanLockName(interface)); });
  EXPECT_TRUE(PortHolder(interface).ends_with(other.Process())) << PortHolder(interface);
  EXPECT_EQ(PortHolder(interface + "0"), "") << "another interface";
}

}  // namespace
}  // namespace axlecast
