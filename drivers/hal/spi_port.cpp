#include "drivers/hal/spi_port.h"

#include <fcntl.h>
#include <linux/spi/spidev.h>
#include <sys/file.h>
#include <sys/ioctl.h>

#include <cerrno>
#include <cstring>
#include <utility>

#include "platform/os/system_clock.h"

namespace axlecast {
namespace {

constexpr std::uint8_t kBitsPerWord = 8;

// Wiring, from the description of the board: unchanged.
constexpr std::uint32_t kWiring = SPI_CS_HIGH | SPI_NO_CS;
// Must be as set here, whatever the last user of the device set.
constexpr std::uint32_t kShape = SPI_CPHA | SPI_CPOL | SPI_LSB_FIRST | SPI_3WIRE | SPI_LOOP;

constexpr const char* kOtherController = ": use another SPI controller";

}  // namespace

tl::unexpected<Error> SpiPort::OpenFailure(int error) const {
  switch (error) {
    case ENOENT:
      return Failure(
          path_ +
          " does not exist: enable the SPI controller and its spidev in the board's configuration (on a "
          "Raspberry Pi dtparam=spi=on), load the module spidev, or correct link.spidev; `ls /dev/spidev*` "
          "shows what there is");
    case EACCES:
      return Failure(
          path_ +
          ": permission denied; let the user use SPI (as root: usermod -aG spi USER; where the group does "
          "not exist a udev rule makes it) and log in again");
    case ENXIO:
    case ENODEV:
    case ESHUTDOWN:
      return Failure(path_ + ": the controller behind it is gone");
    case ENOTTY:
    case EISDIR:
      return Failure(path_ + " is no SPI device: correct link.spidev; `ls /dev/spidev*` shows what there is");
    default:
      return Failure(path_ + ": " + std::strerror(error));
  }
}

Result<> SpiPort::Open() {
  Close();
  Result<> opened = waiter_.CheckReady()
                        .and_then([&] { return Claim(); })
                        .and_then([&] { return SetMode(); })
                        .and_then([&] { return SetWord(); })
                        .and_then([&] { return SetClock(); });
  if (!opened) Close();
  return opened;
}

void SpiPort::Close() {
  device_.Reset();
  DropBytes();
}

Result<> SpiPort::Claim() {
  Descriptor device(open(path_.c_str(), O_RDWR | O_NOCTTY | O_NONBLOCK | O_CLOEXEC));
  if (!device.valid()) return OpenFailure(errno);
  if (flock(device.get(), LOCK_EX | LOCK_NB) != 0) return Failure(path_ + ": " + std::string(kLineHeld));
  device_ = std::move(device);
  return {};
}

Result<> SpiPort::SetMode() const {
  std::uint32_t found = 0;
  if (ioctl(device_.get(), SPI_IOC_RD_MODE32, &found) != 0) return OpenFailure(errno);
  const std::uint32_t wanted = (found & kWiring) | static_cast<std::uint32_t>(settings_.mode);
  std::uint32_t made = 0;
  if (ioctl(device_.get(), SPI_IOC_WR_MODE32, &wanted) == 0 &&
      ioctl(device_.get(), SPI_IOC_RD_MODE32, &made) == 0 && ((made ^ wanted) & kShape) == 0) {
    return {};
  }
  return Failure(path_ + " cannot do SPI mode " + std::to_string(settings_.mode) + kOtherController);
}

Result<> SpiPort::SetWord() const {
  std::uint8_t made = 0;  // 0 means 8 too
  if (ioctl(device_.get(), SPI_IOC_WR_BITS_PER_WORD, &kBitsPerWord) == 0 &&
      ioctl(device_.get(), SPI_IOC_RD_BITS_PER_WORD, &made) == 0 && (made == 0 || made == kBitsPerWord)) {
    return {};
  }
  return Failure(path_ + " cannot do words of 8 bits" + kOtherController);
}

Result<> SpiPort::SetClock() const {
  const auto wanted = static_cast<std::uint32_t>(settings_.clock_hz);
  const std::string clock = std::to_string(wanted);
  std::uint32_t made = 0;
  if (ioctl(device_.get(), SPI_IOC_WR_MAX_SPEED_HZ, &wanted) != 0 ||
      ioctl(device_.get(), SPI_IOC_RD_MAX_SPEED_HZ, &made) != 0) {
    return Failure(path_ + " cannot be clocked at " + clock + " Hz: set link.clock_hz to what it can do");
  }
  if (made == wanted) return {};
  return Failure(path_ + " would be clocked at " + std::to_string(made) + " Hz, not " + clock +
                 ": set link.clock_hz to " + std::to_string(made) + ", or use another SPI controller");
}

bool SpiPort::Write(Bytes bytes) {
  if (!IsOpen() || bytes.empty() || bytes.size() > kMaxFrame) return false;
  const std::span<std::uint8_t> in = Fill(bytes.size());
  spi_ioc_transfer transfer{};
  transfer.tx_buf = reinterpret_cast<std::uintptr_t>(bytes.data());
  transfer.rx_buf = reinterpret_cast<std::uintptr_t>(in.data());
  transfer.len = static_cast<std::uint32_t>(bytes.size());
  transfer.speed_hz = static_cast<std::uint32_t>(settings_.clock_hz);
  transfer.bits_per_word = kBitsPerWord;
  int clocked = 0;
  do {
    clocked = ioctl(device_.get(), SPI_IOC_MESSAGE(1), &transfer);
  } while (clocked < 0 && errno == EINTR);
  if (clocked == static_cast<int>(bytes.size())) return true;
  DropBytes();
  return false;
}

ByteLink::ReadResult SpiPort::Read(std::span<std::uint8_t> into, MonoNs deadline) {
  if (IsOpen() && !HasBytes() && PollUntil({}, deadline, clock_) < 0) return {Status::kLost, 0};
  return ReadNow(into);
}

Link::Status SpiPort::Wait(MonoNs until) { return !HasBytes() ? waiter_.Wait(until) : Status::kOk; }

}  // namespace axlecast
