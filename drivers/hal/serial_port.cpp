#include "drivers/hal/serial_port.h"

#include <asm/ioctls.h>
#include <asm/termbits.h>
#include <fcntl.h>
#include <linux/serial.h>
#include <sys/file.h>
#include <sys/ioctl.h>
#include <sys/stat.h>
#include <sys/sysmacros.h>
#include <unistd.h>
#include <algorithm>
#include <cerrno>
#include <cstdlib>
#include <cstring>

#include "drivers/hal/adapter.h"
#include "drivers/hal/pty.h"
#include "platform/os/system_clock.h"

namespace axlecast {
namespace {

constexpr double kRateTolerance = 0.02;

constexpr const char* kNoSerialPort = " is no serial port: correct link.port";

dev_t DeviceOf(int fd) {
  struct stat status {};
  return fstat(fd, &status) == 0 && S_ISCHR(status.st_mode) ? status.st_rdev : 0;
}

unsigned FormatFlags(const LineFormat& format) {
  unsigned flags = CS8;
  if (format.parity != Parity::kNone) flags |= PARENB;
  if (format.parity == Parity::kOdd) flags |= PARODD;
  if (format.stop_bits == 2) flags |= CSTOPB;
  return flags;
}

termios2 RawMode(const LineFormat& format) {
  termios2 mode{};
  mode.c_cflag = FormatFlags(format) | CREAD | CLOCAL | BOTHER | (BOTHER << IBSHIFT);
  if (format.parity != Parity::kNone) mode.c_iflag |= INPCK;
  mode.c_ispeed = mode.c_ospeed = static_cast<speed_t>(format.baud);
  mode.c_cc[VMIN] = 1;
  return mode;
}

// Requests low latency from the driver. Drivers that support it also accept it from an unprivileged user.
void AskForLowLatency(int line) {
  serial_struct serial{};
  if (ioctl(line, TIOCGSERIAL, &serial) != 0) return;
  serial.flags = static_cast<int>(static_cast<unsigned>(serial.flags) | ASYNC_LOW_LATENCY);
  // The latency timer shows whether it had an effect.
  if (ioctl(line, TIOCSSERIAL, &serial) != 0) return;
}

}  // namespace

tl::unexpected<Error> Tty::OpenFailure(int error) const {
  const std::string& path = settings_.path;
  switch (error) {
    case ENOENT:
      if (settings_.pty.simulated)
        return Failure(path + " does not exist: no simulator runs; start it with `axlecast simulate`");
      return Failure(
          path +
          " does not exist: plug the adapter in, or correct link.port; /dev/serial/by-id/ has lasting names");
    case EACCES:
      return Failure(
          path +
          ": permission denied; let the user use serial ports (as root: usermod -aG dialout USER) and log "
          "in again");
    case EBUSY:
      return Failure(path + ": " + std::string(kLineHeld));
    case ENXIO:
    case EIO:
    case ENODEV:
      return Failure(path + ": the device behind it is gone; plug the adapter in again");
    default:
      return Failure(path + ": " + std::strerror(error));
  }
}

Result<Descriptor> Tty::OpenLine() const {
  LineGuard guard(settings_.path, settings_.pty);
  if (const Result<> line_is_free = guard.Before(); !line_is_free) return Failure(line_is_free.error());
  Descriptor line(open(settings_.path.c_str(), O_RDWR | O_NOCTTY | O_NONBLOCK | O_CLOEXEC));
  if (!line.valid()) return OpenFailure(errno);
  if (DeviceOf(line.get()) == 0) return Failure(settings_.path + kNoSerialPort);
  if (const Result<> is_line = guard.After(line.get()); !is_line) return Failure(is_line.error());
  if (MakeRaw(line.get())) return line;
  return errno == ENOTTY ? Failure(settings_.path + kNoSerialPort) : OpenFailure(errno);
}

Result<> Tty::Claim() {
  warnings_.clear();
  Release();
  Result<Descriptor> line = OpenLine();
  if (!line) return Failure(line.error());
  if (flock(line->get(), LOCK_EX | LOCK_NB) != 0) return OpenFailure(EBUSY);
  line_ = std::move(*line);
  if (IsPty()) return {};
  Result<> fits = CheckHardware();
  if (!fits) Release();
  return fits;
}

std::string Tty::OpenPath() const { return "/proc/self/fd/" + std::to_string(line_.get()); }

int Tty::OpenBlocking() {
  blocking_ = Descriptor(open(OpenPath().c_str(), O_RDWR | O_NOCTTY | O_CLOEXEC));
  return blocking_.get();
}

bool Tty::IsPty() const { return IsPtyDevice(DeviceOf(line_.get())); }

bool Tty::IsBehind(int fd) const {
  const dev_t device = DeviceOf(fd);
  return device != 0 && device == DeviceOf(line_.get());
}

Result<> Tty::Exclude() {
  // A pty would stay exclusive after the driver has ended, until its simulator closes it.
  if (IsPty() || ioctl(line_.get(), TIOCEXCL) == 0) return {};
  return OpenFailure(errno);
}

bool Tty::Admit() { return IsPty() || ioctl(line_.get(), TIOCNXCL) == 0; }

Result<> Tty::CheckHardware() {
  const dev_t device = DeviceOf(line_.get());
  const TtyFacts facts = ReadTtyFacts(settings_.sysfs, major(device), minor(device));
  if (facts.usb) {
    AdapterVerdict verdict = CheckAdapter(*facts.usb, settings_.format.baud);
    if (!verdict.fits) return Failure(settings_.path + ": " + verdict.text);
    if (!verdict.text.empty()) warnings_.push_back(std::move(verdict.text));
  }
  if (!settings_.low_latency) return {};
  AskForLowLatency(line_.get());
  if (facts.latency_timer.empty()) return {};
  if (Result<> fast = ShortenLatency(facts.latency_timer); !fast) warnings_.push_back(std::move(fast.error().text));
  return {};
}

bool Tty::CanMake(std::int64_t baud) const {
  const dev_t device = DeviceOf(line_.get());
  const TtyFacts facts = ReadTtyFacts(settings_.sysfs, major(device), minor(device));
  return baud > 0 && (!facts.usb || CheckAdapter(*facts.usb, baud).fits);
}

Result<> Tty::SetFormat(const LineFormat& format) {
  const termios2 mode = RawMode(format);
  if (ioctl(line_.get(), TCSETS2, &mode) != 0) {
    return Failure(settings_.path + " refuses its settings: " + std::strerror(errno));
  }
  return CheckFormat(format);
}

Result<> Tty::AdoptFormat(const LineFormat& format) {
  termios2 mode{};
  if (ioctl(line_.get(), TCGETS2, &mode) != 0) return OpenFailure(errno);
  mode.c_cc[VMIN] = 1;
  if (ioctl(line_.get(), TCSETS2, &mode) != 0) return OpenFailure(errno);
  return CheckFormat(format);
}

Result<> Tty::CheckFormat(const LineFormat& format) const {
  termios2 mode{};
  if (ioctl(line_.get(), TCGETS2, &mode) != 0) return OpenFailure(errno);
  const auto wanted = static_cast<double>(format.baud);
  if (std::abs(static_cast<double>(mode.c_ospeed) - wanted) > kRateTolerance * wanted) {
    return Failure(settings_.path + " makes " + std::to_string(mode.c_ospeed) + " baud of the " +
                   std::to_string(format.baud) + " asked for: it cannot do this rate; use another port or adapter");
  }
  // The kernel ignores parity and stop bits on a pty.
  if (!IsPty() && ((mode.c_cflag ^ FormatFlags(format)) & (PARENB | PARODD | CSTOPB | CSIZE)) != 0) {
    return Failure(settings_.path + " does not take the character format asked for: use another port or adapter");
  }
  return {};
}

bool Tty::Drain() {
  MonoNs give_up = clock_.Now() + kWriteTimeout;
  int minimum = INT32_MAX;
  while (true) {
    int queued = 0;
    if (ioctl(line_.get(), TIOCOUTQ, &queued) != 0) return false;
    if (queued == 0) break;
    const MonoNs now = clock_.Now();
    if (queued < minimum) give_up = now + kWriteTimeout;
    if (now >= give_up) return false;
    minimum = std::min(minimum, queued);
    if (PollUntil({}, now + kMillisecond, clock_) < 0) return false;
  }
  // Waits for the buffer of the hardware. The driver limits this time.
  int drained = 0;
  do {
    drained = ioctl(line_.get(), TCSBRK, 1);
  } while (drained != 0 && errno == EINTR);
  return drained == 0;
}

Result<> Tty::Reset() {
  if (ioctl(line_.get(), TCFLSH, TCIOFLUSH) != 0) return OpenFailure(errno);
  at_start_ = Counted();
  return {};
}

ByteLink::LineErrors Tty::Counted() const {
  serial_icounter_struct counters{};
  if (ioctl(line_.get(), TIOCGICOUNT, &counters) != 0) return {};  // not supported by this driver
  return {std::int64_t{counters.frame} + counters.parity + counters.brk,
          std::int64_t{counters.overrun} + counters.buf_overrun};
}

ByteLink::LineErrors Tty::Errors() const {
  const ByteLink::LineErrors now = Counted();
  return {std::max<std::int64_t>(now.framing - at_start_.framing, 0),
          std::max<std::int64_t>(now.dropped - at_start_.dropped, 0)};
}

Result<> SerialPort::Open() {
  Close();
  Result<> opened = reader_.CheckReady().and_then([&] { return tty_.Claim(); });
  const int blocking = opened ? tty_.OpenBlocking() : -1;  // before others are excluded
  opened = std::move(opened)
               .and_then([&] { return tty_.Exclude(); })
               .and_then([&] { return tty_.SetFormat(tty_.settings().format); })
               .and_then([&] { return tty_.Reset(); });
  if (opened) {
    reader_.Attach(tty_.FileDescriptor(), blocking);
  } else {
    Close();
  }
  return opened;
}

void SerialPort::Close() {
  reader_.Detach();
  tty_.Release();
}

bool SerialPort::Write(Bytes bytes) {
  MonoNs give_up = 0;
  while (!bytes.empty()) {
    const ssize_t written = write(tty_.FileDescriptor(), bytes.data(), bytes.size());
    if (written > 0) {
      bytes = bytes.subspan(static_cast<std::size_t>(written));
      give_up = 0;
      continue;
    }
    if (written < 0 && errno == EINTR) continue;
    if (written < 0 && errno != EAGAIN) return false;
    if (give_up == 0) give_up = clock_.Now() + kWriteTimeout;
    if (!reader_.WaitWritable(give_up)) return false;
  }
  return true;
}

}  // namespace axlecast
