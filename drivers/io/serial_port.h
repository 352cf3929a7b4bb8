#pragma once

#include <atomic>
#include <cstdint>
#include <string>
#include <vector>

#include "drivers/io/descriptor.h"
#include "drivers/runtime/core/byte_link.h"
#include "drivers/runtime/core/clock.h"

namespace axlecast {

struct SerialSettings {
  enum class Parity : std::uint8_t { kNone, kEven, kOdd };

  std::string path;       // a tty, a pty, or a link to one (/dev/serial/by-id/...)
  std::int64_t baud = 0;  // any rate: set with BOTHER
  Parity parity = Parity::kNone;
  int stop_bits = 1;           // 1 or 2; a character always has 8 data bits
  bool low_latency = true;     // asks the driver for 1 ms latency where it can
  std::string sysfs = "/sys";  // tests bring their own
};

// A serial port or pty as a raw line of bytes, locked against a second user (TIOCEXCL and flock). After kLost, or a
// Write that returned false, Close and Open again: the adapter or pty may have come back under the same path.
// One thread uses it; Wake may be called from any.
class SerialPort final : public ByteLink {
 public:
  SerialPort(SerialSettings settings, const Clock& clock);
  ~SerialPort() override;
  SerialPort(const SerialPort&) = delete;
  SerialPort& operator=(const SerialPort&) = delete;

  [[nodiscard]] std::string Open() override;
  void Close() override;
  [[nodiscard]] bool IsOpen() const override { return line_.get() >= 0; }
  [[nodiscard]] bool Write(Bytes bytes) override;
  [[nodiscard]] ReadResult Read(std::span<std::uint8_t> into, MonoNs deadline) override;
  [[nodiscard]] ReadResult ReadNow(std::span<std::uint8_t> into) override;
  [[nodiscard]] Status Wait(MonoNs until) override;
  void Wake() override;
  [[nodiscard]] LineErrors Errors() const override;

  // What the last successful Open found wanting (a slow latency timer, an adapter that cannot reach the rate), each
  // with its remedy.
  [[nodiscard]] const std::vector<std::string>& warnings() const { return warnings_; }

 private:
  [[nodiscard]] std::string Configure();
  [[nodiscard]] std::string JudgeHardware(unsigned major, unsigned minor);
  [[nodiscard]] std::string CheckMode(std::int64_t baud, unsigned flags, bool pty) const;
  [[nodiscard]] LineErrors Counted() const;

  SerialSettings settings_;
  const Clock& clock_;
  Descriptor line_;
  Descriptor wake_;
  LineErrors at_open_;
  std::vector<std::string> warnings_;
};

}  // namespace axlecast
