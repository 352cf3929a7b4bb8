#include "drivers/hal/pulse_lines.h"

#include <gpiod.h>
#include <sys/socket.h>
#include <unistd.h>
#include <array>
#include <cerrno>
#include <cstring>
#include <utility>

#include "core/base/result.h"
#include "platform/net/unix_address.h"
#include "platform/os/system_clock.h"

namespace axlecast {
namespace {

constexpr const char* kConsumer = "axlecast";

// "line clk (/dev/gpiochip0 17)"
std::string Name(const PulseLineConfig& line) {
  return "line " + line.name + " (" + line.chip + ' ' + std::to_string(line.offset) + ')';
}

tl::unexpected<Error> ChipFailure(const PulseLineConfig& line, int error) {
  switch (error) {
    case ENOENT:
      return Failure(Name(line) + ": there is no such chip; gpiodetect lists this machine's");
    case EACCES:
    case EPERM:
      return Failure(Name(line) +
                     ": permission denied; let the user use GPIO (as root: usermod -aG gpio USER; where no group "
                     "gpio is, a udev rule gives " +
                     line.chip + " to one) and log in again");
    case ENOTTY:
    case ENODEV:
      return Failure(Name(line) + ": that is no GPIO chip; gpiodetect lists this machine's");
    default:
      return Failure(Name(line) + ": " + std::strerror(error));
  }
}

// A pulse as a datagram: the index of the line, then the duration in ns, low byte first.
constexpr std::size_t kDatagram = 1 + sizeof(MonoNs);
using Datagram = std::array<std::uint8_t, kDatagram>;

Datagram Encode(std::uint8_t line, MonoNs low) {
  Datagram datagram{line};
  for (std::size_t i = 1; i < kDatagram; ++i) datagram[i] = static_cast<std::uint8_t>(low >> (8 * (i - 1)));
  return datagram;
}

Pulse Decode(const Datagram& datagram) {
  std::uint64_t low = 0;
  for (std::size_t i = kDatagram - 1; i > 0; --i) low = low << 8 | datagram[i];
  return {.line = datagram[0], .low = static_cast<MonoNs>(low)};
}

}  // namespace

// A claimed line, driven until it is destroyed.
class GpioLines::Line {
 public:
  explicit Line(gpiod_chip* chip) : chip_(chip) {}
  ~Line() {
    if (requested_) gpiod_line_release(line_);
    gpiod_chip_close(chip_);
  }
  Line(const Line&) = delete;
  Line& operator=(const Line&) = delete;

  [[nodiscard]] Result<> Request(const PulseLineConfig& config) {
    line_ = gpiod_chip_get_line(chip_, static_cast<unsigned>(config.offset));
    if (line_ == nullptr) {
      return Failure(Name(config) + ": the chip has lines 0 to " +
                     std::to_string(int(gpiod_chip_num_lines(chip_)) - 1) + "; gpioinfo lists them");
    }
    requested_ = gpiod_line_request_output(line_, kConsumer, 1) == 0;
    if (requested_) return {};
    return RequestFailure(config, errno);
  }
  [[nodiscard]] bool Set(bool high) { return gpiod_line_set_value(line_, high ? 1 : 0) == 0; }

 private:
  [[nodiscard]] tl::unexpected<Error> RequestFailure(const PulseLineConfig& config, int error) {
    if (error != EBUSY) return ChipFailure(config, error);
    // The name may have been read before the other process took the line.
    const char* const consumer = gpiod_line_update(line_) == 0 ? gpiod_line_consumer(line_) : nullptr;
    return Failure(Name(config) + (consumer == nullptr ? "" : ", taken by '" + std::string(consumer) + "'") + ": " +
                   std::string(kLineHeld));
  }

  gpiod_chip* chip_;
  gpiod_line* line_ = nullptr;
  bool requested_ = false;
};

GpioLines::GpioLines(std::vector<PulseLineConfig> lines, const Clock& clock)
    : lines_(std::move(lines)), clock_(clock) {}

GpioLines::~GpioLines() = default;

void GpioLines::Close() { claimed_.clear(); }

Result<> GpioLines::Open() {
  Close();
  for (const PulseLineConfig& line : lines_) {
    Result<> claimed = Claim(line);
    if (claimed) continue;
    Close();
    return claimed;
  }
  return {};
}

Result<> GpioLines::Claim(const PulseLineConfig& config) {
  gpiod_chip* const chip = gpiod_chip_open(config.chip.c_str());
  if (chip == nullptr) return ChipFailure(config, errno);
  claimed_.push_back(std::make_unique<Line>(chip));
  return claimed_.back()->Request(config);
}

bool GpioLines::Pulse(std::uint8_t line, MonoNs low) {
  if (line >= claimed_.size()) return false;
  // Drives the line high even if driving it low failed.
  const bool was_low = claimed_[line]->Set(false);
  WaitUntil(clock_.Now() + low, clock_);
  return claimed_[line]->Set(true) && was_low;
}

// ---- the end of the driver ----

Result<> SimulatedLines::Open() {
  const Result<UnixAddress> address = UnixAddress::Of(path_);
  if (!address) return Failure(address.error());
  Descriptor socket_to_it(socket(AF_UNIX, SOCK_DGRAM | SOCK_NONBLOCK | SOCK_CLOEXEC, 0));
  if (!socket_to_it.valid()) return Failure(path_ + ": " + std::strerror(errno));
  if (connect(socket_to_it.get(), address->generic(), address->size()) != 0) {
    return Failure("no simulator moves the lines of this bus (" + path_ + ": " + std::strerror(errno) +
                   "): start it with `axlecast simulate`");
  }
  socket_ = std::move(socket_to_it);
  return {};
}

bool SimulatedLines::Pulse(std::uint8_t line, MonoNs low) {
  WaitUntil(clock_.Now() + low, clock_);
  const Datagram datagram = Encode(line, low);
  const auto sent = [&] {
    return send(socket_.get(), datagram.data(), datagram.size(), MSG_NOSIGNAL) ==
           static_cast<ssize_t>(datagram.size());
  };
  // ECONNREFUSED the first time after the simulator has gone, ENOTCONN from then on.
  return sent() || ((errno == ECONNREFUSED || errno == ENOTCONN) && Open() && sent());
}

// ---- the end of the simulator ----

SimulatedLinesPort::~SimulatedLinesPort() {
  if (socket_.valid()) static_cast<void>(unlink(path_.c_str()));
}

Result<> SimulatedLinesPort::Listen(const std::string& path) {
  Result<Descriptor> bound = BindUnixSocket(path, SOCK_DGRAM);
  if (!bound) return Failure(bound.error());
  socket_ = std::move(*bound);
  path_ = path;
  return {};
}

std::optional<Pulse> SimulatedLinesPort::Next() {
  while (true) {
    Datagram datagram{};
    // MSG_TRUNC returns the whole length, so that a longer datagram is noticed.
    const ssize_t size = recv(socket_.get(), datagram.data(), datagram.size(), MSG_TRUNC);
    if (size < 0 && errno == EINTR) continue;
    if (size < 0) return std::nullopt;
    if (size != static_cast<ssize_t>(kDatagram)) continue;
    const axlecast::Pulse pulse = Decode(datagram);
    if (pulse.low >= 0) return pulse;
  }
}

}  // namespace axlecast
