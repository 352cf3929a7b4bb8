// cuse_spidev NAME SOCKET: appears as /dev/NAME (spidev0.0) and hands every transfer to the simulator that listens on
// SOCKET, as a controller would put it on the wire (drivers/hal/simulated_spi.h). Needs root and the module cuse.
//
// It answers as drivers/spi/spidev.c does for a controller that knows SPI modes 0 to 3 and words of 8 bits: others
// are refused with EINVAL, more than 4096 bytes with EMSGSIZE. Without a simulator a transfer ends with EIO.

#define FUSE_USE_VERSION 35

#include <cuse_lowlevel.h>
#include <fuse_opt.h>
#include <linux/spi/spidev.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstdint>
#include <cstdio>
#include <cstring>
#include <optional>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "drivers/hal/simulated_spi.h"
#include "platform/os/system_clock.h"

namespace axlecast {
namespace {

constexpr std::size_t kSpidevBuffer = 4096;          // spidev.c, bufsiz
constexpr std::uint32_t kControllerHz = 10'000'000;  // its highest clock

// One ioctl. The first attempt brings only `argument`: what it points to is asked for, and the kernel comes again.
struct Call {
  fuse_req_t request;
  void* argument;
  std::span<const std::uint8_t> in;
  std::size_t out_size;

  void Fail(int error) const { fuse_reply_err(request, error); }
  void Done() const { fuse_reply_ioctl(request, 0, nullptr, 0); }

  template <typename T>
  void Give(T value) const {
    if (out_size < sizeof value) {
      const iovec out{argument, sizeof value};
      fuse_reply_ioctl_retry(request, nullptr, 0, &out, 1);
    } else {
      fuse_reply_ioctl(request, 0, &value, sizeof value);
    }
  }

  // Nothing when the kernel has to come again.
  template <typename T>
  [[nodiscard]] std::optional<T> Take() const {
    if (in.size() < sizeof(T)) {
      const iovec from{argument, sizeof(T)};
      fuse_reply_ioctl_retry(request, &from, 1, nullptr, 0);
      return std::nullopt;
    }
    T value;
    std::memcpy(&value, in.data(), sizeof value);
    return value;
  }
};

void* Pointer(std::uint64_t address) { return reinterpret_cast<void*>(static_cast<std::uintptr_t>(address)); }

using Transfers = std::vector<spi_ioc_transfer>;

// The caller's memory that an ioctl reads and writes.
struct Buffers {
  std::vector<iovec> in;
  std::vector<iovec> out;
  std::size_t in_size = 0;
  std::size_t out_size = 0;

  void Add(const Transfers& transfers) {
    for (const spi_ioc_transfer& transfer : transfers) {
      if (transfer.len == 0) continue;
      if (transfer.tx_buf != 0) {
        in.push_back({Pointer(transfer.tx_buf), transfer.len});
        in_size += transfer.len;
      }
      if (transfer.rx_buf != 0) {
        out.push_back({Pointer(transfer.rx_buf), transfer.len});
        out_size += transfer.len;
      }
    }
  }
  // The kernel comes again with them.
  void Ask(const Call& call) const {
    fuse_reply_ioctl_retry(call.request, in.data(), in.size(), out.data(), out.size());
  }
};

class Spidev {
 public:
  explicit Spidev(std::string socket) : simulator_(std::move(socket), {}, clock_) {}

  void Control(unsigned command, const Call& call) {
    switch (command) {
      case SPI_IOC_RD_MODE:
        return call.Give(static_cast<std::uint8_t>(mode_));
      case SPI_IOC_RD_MODE32:
        return call.Give(mode_);
      case SPI_IOC_RD_LSB_FIRST:
        return call.Give(std::uint8_t{0});
      case SPI_IOC_RD_BITS_PER_WORD:
        return call.Give(bits_per_word_);
      case SPI_IOC_RD_MAX_SPEED_HZ:
        return call.Give(clock_hz_);
      case SPI_IOC_WR_MODE:
        return Set<std::uint8_t>(call, mode_, [](auto mode) { return mode <= 3; });
      case SPI_IOC_WR_MODE32:
        return Set<std::uint32_t>(call, mode_, [](auto mode) { return mode <= 3; });
      case SPI_IOC_WR_BITS_PER_WORD:
        return Set<std::uint8_t>(call, bits_per_word_, [](auto bits) { return bits == 0 || bits == 8; });
      case SPI_IOC_WR_MAX_SPEED_HZ:
        return Set<std::uint32_t>(call, clock_hz_, [](auto hz) { return hz > 0; });
      default:
        return Message(command, call);
    }
  }

 private:
  template <typename T, typename Value, typename Allowed>
  static void Set(const Call& call, Value& value, Allowed allowed) {
    const std::optional<T> wanted = call.Take<T>();
    if (!wanted) return;
    if (!allowed(*wanted)) return call.Fail(EINVAL);
    value = *wanted;
    call.Done();
  }

  // SPI_IOC_MESSAGE(n)
  void Message(unsigned command, const Call& call) {
    const std::size_t size = _IOC_SIZE(command);
    const bool is_message = _IOC_TYPE(command) == SPI_IOC_MAGIC && _IOC_NR(command) == 0 &&
                            _IOC_DIR(command) == _IOC_WRITE && size % sizeof(spi_ioc_transfer) == 0;
    if (!is_message) return call.Fail(ENOTTY);
    if (size == 0) return call.Done();
    Buffers buffers{.in = {{call.argument, size}}, .out = {}, .in_size = size, .out_size = 0};
    if (call.in.empty()) return buffers.Ask(call);
    Transfers transfers(size / sizeof(spi_ioc_transfer));
    std::memcpy(transfers.data(), call.in.data(), size);
    if (const int error = Refusal(transfers); error != 0) return call.Fail(error);
    buffers.Add(transfers);
    if (call.in.size() != buffers.in_size || call.out_size != buffers.out_size) return buffers.Ask(call);
    Clock(transfers, call, call.in.subspan(size));
  }

  static int Refusal(const Transfers& transfers) {
    std::size_t total = 0;
    for (const spi_ioc_transfer& transfer : transfers) {
      if (transfer.bits_per_word != 0 && transfer.bits_per_word != 8) return EINVAL;
      if (transfer.len > kSpidevBuffer) return EMSGSIZE;
      total += transfer.len;
    }
    return total > kSpidevBuffer ? EMSGSIZE : 0;
  }

  // All transfers one after the other; `tx` holds what those clock out that clock out anything.
  void Clock(const Transfers& transfers, const Call& call, std::span<const std::uint8_t> tx) {
    std::vector<std::uint8_t> received;
    int total = 0;
    for (const spi_ioc_transfer& transfer : transfers) {
      std::vector<std::uint8_t> sent(transfer.len);  // zeros where nothing is given
      if (transfer.tx_buf != 0) {
        std::memcpy(sent.data(), tx.data(), sent.size());
        tx = tx.subspan(sent.size());
      }
      std::vector<std::uint8_t> in(transfer.len);
      if (!in.empty() && !Exchange(transfer, sent, in)) return call.Fail(EIO);
      if (transfer.rx_buf != 0) received.insert(received.end(), in.begin(), in.end());
      total += static_cast<int>(transfer.len);
      if (transfer.delay_usecs > 0) WaitUntil(clock_.Now() + transfer.delay_usecs * kMicrosecond, clock_);
    }
    fuse_reply_ioctl(call.request, total, received.data(), received.size());
  }

  bool Exchange(const spi_ioc_transfer& transfer, Bytes tx, std::span<std::uint8_t> rx) {
    if (!simulator_.IsOpen()) {
      if (const Result<> opened = simulator_.Open(); !opened) {
        std::fprintf(stderr, "%s\n", opened.error().text.c_str());
        return false;
      }
    }
    const std::uint32_t clock_hz = std::min(transfer.speed_hz != 0 ? transfer.speed_hz : clock_hz_, kControllerHz);
    const bool done = simulator_.Transfer(
        {.settings = {.mode = static_cast<int>(mode_), .clock_hz = clock_hz}, .bits_per_word = 8, .tx = tx}, rx);
    if (!done) simulator_.Close();
    return done;
  }

  SystemClock clock_;
  SimulatedSpi simulator_;
  std::uint32_t mode_ = 0;
  std::uint8_t bits_per_word_ = 8;
  std::uint32_t clock_hz_ = kControllerHz;
};

void Open(fuse_req_t request, fuse_file_info* file) { fuse_reply_open(request, file); }

void Control(fuse_req_t request, int command, void* argument, fuse_file_info*, unsigned, const void* in,
             std::size_t in_size, std::size_t out_size) {
  auto& device = *static_cast<Spidev*>(fuse_req_userdata(request));
  device.Control(static_cast<unsigned>(command),
                 {request, argument, {static_cast<const std::uint8_t*>(in), in_size}, out_size});
}

int Main(int argc, char** argv) {
  if (argc != 3) {
    std::fputs("usage: cuse_spidev NAME SOCKET   e.g. cuse_spidev spidev0.0 /run/axlecast/spi-0.spi\n", stderr);
    return 2;
  }
  Spidev device(argv[2]);
  const std::string name = std::string("DEVNAME=") + argv[1];
  std::array<const char*, 1> description{name.c_str()};
  cuse_info info{};
  info.dev_info_argc = description.size();
  info.dev_info_argv = description.data();
  info.flags = CUSE_UNRESTRICTED_IOCTL;
  cuse_lowlevel_ops operations{};
  operations.open = Open;
  operations.ioctl = Control;
  // In the foreground, one request after the other: a bus has one controller.
  std::string program = argv[0];
  std::string foreground = "-f";
  std::string single = "-s";
  std::array<char*, 3> options{program.data(), foreground.data(), single.data()};
  return cuse_lowlevel_main(static_cast<int>(options.size()), options.data(), &info, &operations, &device);
}

}  // namespace
}  // namespace axlecast

int main(int argc, char** argv) { return axlecast::Main(argc, argv); }
