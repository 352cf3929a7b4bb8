#include "drivers/io/serial_port.h"

#include <asm/ioctls.h>
#include <asm/termbits.h>
#include <fcntl.h>
#include <linux/serial.h>
#include <poll.h>
#include <sys/eventfd.h>
#include <sys/file.h>
#include <sys/ioctl.h>
#include <sys/stat.h>
#include <sys/sysmacros.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstdlib>
#include <cstring>
#include <ctime>
#include <utility>

#include "drivers/io/adapter.h"

namespace axlecast {
namespace {

// A line that takes no byte for so long is as good as gone.
constexpr MonoNs kWriteTimeout = kSecond;
constexpr double kRateTolerance = 0.02;

constexpr const char* kSecondDriver = "another process holds it: is a second driver running?";

timespec ToTimespec(MonoNs duration) {
  const MonoNs positive = std::max<MonoNs>(duration, 0);
  return {positive / kSecond, positive % kSecond};
}

// Waits for one of `lines` until `deadline`; like poll, with EINTR over and done with.
int PollUntil(std::span<pollfd> lines, MonoNs deadline, const Clock& clock) {
  while (true) {
    const timespec left = ToTimespec(deadline == kNever ? 0 : deadline - clock.Now());
    const int ready = ppoll(lines.data(), lines.size(), deadline == kNever ? nullptr : &left, nullptr);
    if (ready >= 0 || errno != EINTR) return ready;
  }
}

bool IsPty(const struct stat& status) {
  const unsigned number = major(status.st_rdev);
  return number >= 136 && number <= 143;  // Documentation/admin-guide/devices.txt: Unix98 PTY slaves
}

std::string OpenProblem(const std::string& path, int error) {
  switch (error) {
    case ENOENT:
      return path +
             " does not exist: plug the adapter in, or correct link.port; lasting names stand in "
             "/dev/serial/by-id/";
    case EACCES:
      return path +
             ": permission denied; let the user use serial ports (as root: usermod -aG dialout USER) and log "
             "in again";
    case EBUSY:
      return path + ": " + kSecondDriver;
    case ENXIO:
    case EIO:
    case ENODEV:
      return path + ": the device behind it is gone; plug the adapter in again";
    default:
      return path + ": " + std::strerror(error);
  }
}

termios2 RawMode(const SerialSettings& settings) {
  termios2 mode{};
  mode.c_cflag = CS8 | CREAD | CLOCAL | BOTHER | (BOTHER << IBSHIFT);
  if (settings.parity != SerialSettings::Parity::kNone) {
    mode.c_cflag |= PARENB;
    mode.c_iflag |= INPCK;
  }
  if (settings.parity == SerialSettings::Parity::kOdd) mode.c_cflag |= PARODD;
  if (settings.stop_bits == 2) mode.c_cflag |= CSTOPB;
  mode.c_ispeed = mode.c_ospeed = static_cast<speed_t>(settings.baud);
  mode.c_cc[VMIN] = 1;
  return mode;
}

// Asks the driver to hand bytes over at once; the drivers that know it do so for an unprivileged user too.
void AskForLowLatency(int line) {
  serial_struct serial{};
  if (ioctl(line, TIOCGSERIAL, &serial) != 0) return;
  serial.flags = static_cast<int>(static_cast<unsigned>(serial.flags) | ASYNC_LOW_LATENCY);
  // Whether it helped is judged by the latency timer.
  if (ioctl(line, TIOCSSERIAL, &serial) != 0) return;
}

}  // namespace

SerialPort::SerialPort(SerialSettings settings, const Clock& clock)
    : settings_(std::move(settings)), clock_(clock), wake_(eventfd(0, EFD_CLOEXEC | EFD_NONBLOCK)) {}

SerialPort::~SerialPort() = default;

std::string SerialPort::Open() {
  Close();
  warnings_.clear();
  if (!wake_.valid()) return std::string("eventfd: ") + std::strerror(errno);
  line_ = Descriptor(open(settings_.path.c_str(), O_RDWR | O_NOCTTY | O_NONBLOCK | O_CLOEXEC));
  if (!line_.valid()) return OpenProblem(settings_.path, errno);
  std::string problem = Configure();
  if (!problem.empty()) Close();
  return problem;
}

void SerialPort::Close() { line_.Reset(); }

std::string SerialPort::Configure() {
  struct stat status {};
  if (fstat(line_.get(), &status) != 0) return OpenProblem(settings_.path, errno);
  termios2 mode{};
  if (!S_ISCHR(status.st_mode)) return settings_.path + " is no serial port: correct link.port";
  if (ioctl(line_.get(), TCGETS2, &mode) != 0) {
    return errno == ENOTTY ? settings_.path + " is no serial port: correct link.port"
                           : OpenProblem(settings_.path, errno);
  }
  if (flock(line_.get(), LOCK_EX | LOCK_NB) != 0) return settings_.path + ": " + kSecondDriver;
  const bool pty = IsPty(status);
  // A pty keeps its exclusive mode as long as its simulator holds it open, beyond the death of a driver.
  if (!pty && ioctl(line_.get(), TIOCEXCL) != 0) return OpenProblem(settings_.path, errno);
  if (!pty) {
    if (std::string problem = JudgeHardware(major(status.st_rdev), minor(status.st_rdev)); !problem.empty()) {
      return problem;
    }
  }
  mode = RawMode(settings_);
  if (ioctl(line_.get(), TCSETS2, &mode) != 0 || ioctl(line_.get(), TCGETS2, &mode) != 0) {
    return settings_.path + " refuses its settings: " + std::strerror(errno);
  }
  if (std::string problem = CheckMode(mode.c_ospeed, mode.c_cflag, pty); !problem.empty()) return problem;
  if (ioctl(line_.get(), TCFLSH, TCIOFLUSH) != 0) return OpenProblem(settings_.path, errno);
  at_open_ = Counted();
  return "";
}

std::string SerialPort::JudgeHardware(unsigned major, unsigned minor) {
  const TtyFacts facts = ReadTtyFacts(settings_.sysfs, major, minor);
  if (facts.usb) {
    AdapterVerdict verdict = JudgeAdapter(*facts.usb, settings_.baud);
    if (!verdict.fits) return settings_.path + ": " + verdict.text;
    if (!verdict.text.empty()) warnings_.push_back(std::move(verdict.text));
  }
  if (!settings_.low_latency) return "";
  AskForLowLatency(line_.get());
  if (facts.latency_timer.empty()) return "";
  if (std::string slow = ShortenLatency(facts.latency_timer); !slow.empty()) warnings_.push_back(std::move(slow));
  return "";
}

std::string SerialPort::CheckMode(std::int64_t baud, unsigned flags, bool pty) const {
  const auto wanted = static_cast<double>(settings_.baud);
  if (std::abs(static_cast<double>(baud) - wanted) > kRateTolerance * wanted) {
    return settings_.path + " makes " + std::to_string(baud) + " baud of the " + std::to_string(settings_.baud) +
           " asked for: it cannot do this rate; use another port or adapter";
  }
  const termios2 asked = RawMode(settings_);
  // The kernel takes parity and stop bits from no pty.
  if (!pty && ((flags ^ asked.c_cflag) & (PARENB | PARODD | CSTOPB | CSIZE)) != 0) {
    return settings_.path + " does not take the character format asked for: use another port or adapter";
  }
  return "";
}

bool SerialPort::Write(Bytes bytes) {
  MonoNs give_up = 0;
  while (!bytes.empty()) {
    const ssize_t written = write(line_.get(), bytes.data(), bytes.size());
    if (written > 0) {
      bytes = bytes.subspan(static_cast<std::size_t>(written));
      continue;
    }
    if (written < 0 && errno == EINTR) continue;
    if (written < 0 && errno != EAGAIN) return false;
    if (give_up == 0) give_up = clock_.Now() + kWriteTimeout;
    pollfd writable{line_.get(), POLLOUT, 0};
    if (PollUntil({&writable, 1}, give_up, clock_) <= 0 || (writable.revents & POLLHUP) != 0) return false;
  }
  return true;
}

ByteLink::ReadResult SerialPort::Read(std::span<std::uint8_t> into, MonoNs deadline) {
  if (!IsOpen()) return {Status::kLost, 0};
  while (true) {
    pollfd readable{line_.get(), POLLIN, 0};
    const int ready = PollUntil({&readable, 1}, deadline, clock_);
    if (ready == 0) return {Status::kTimeout, 0};
    if (ready < 0) return {Status::kLost, 0};
    // Bytes that came before a hang-up are still there.
    const ReadResult result = ReadNow(into);
    if (result.status != Status::kTimeout) return result;
    if ((readable.revents & (POLLHUP | POLLERR | POLLNVAL)) != 0) return {Status::kLost, 0};
  }
}

ByteLink::ReadResult SerialPort::ReadNow(std::span<std::uint8_t> into) {
  if (into.empty()) return {Status::kTimeout, 0};
  while (true) {
    const ssize_t count = read(line_.get(), into.data(), into.size());
    if (count > 0) return {Status::kOk, static_cast<std::size_t>(count)};
    if (count < 0 && errno == EINTR) continue;
    if (count < 0 && errno == EAGAIN) return {Status::kTimeout, 0};
    return {Status::kLost, 0};  // 0: hung up
  }
}

ByteLink::Status SerialPort::Wait(MonoNs until) {
  std::array<pollfd, 2> lines{{{wake_.get(), POLLIN, 0}, {line_.get(), POLLIN, 0}}};  // poll passes over fd -1
  const int ready = PollUntil(lines, until, clock_);
  if (ready < 0) return Status::kLost;
  if ((lines[0].revents & POLLIN) != 0) {
    std::uint64_t wakes = 0;
    if (read(wake_.get(), &wakes, sizeof wakes) > 0) return Status::kWoken;
  }
  if ((lines[1].revents & POLLIN) != 0) return Status::kOk;
  if (lines[1].revents != 0) return Status::kLost;
  return Status::kTimeout;
}

void SerialPort::Wake() {
  const std::uint64_t one = 1;
  // A full counter means that the sleeper is woken already.
  [[maybe_unused]] const ssize_t written = write(wake_.get(), &one, sizeof one);
}

ByteLink::LineErrors SerialPort::Counted() const {
  serial_icounter_struct counters{};
  if (ioctl(line_.get(), TIOCGICOUNT, &counters) != 0) return {};  // this driver does not tell
  return {std::int64_t{counters.frame} + counters.parity + counters.brk,
          std::int64_t{counters.overrun} + counters.buf_overrun};
}

ByteLink::LineErrors SerialPort::Errors() const {
  const LineErrors now = Counted();
  return {std::max<std::int64_t>(now.framing - at_open_.framing, 0),
          std::max<std::int64_t>(now.dropped - at_open_.dropped, 0)};
}

}  // namespace axlecast
