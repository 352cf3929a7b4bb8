#pragma once

#include <cstdint>
#include <string>
#include <utility>
#include <vector>

#include "core/base/time.h"
#include "core/device/line_settings.h"
#include "core/device/link.h"
#include "drivers/hal/line_guard.h"
#include "drivers/hal/line_reader.h"
#include "platform/os/descriptor.h"

namespace axlecast {

// A line that takes no byte for so long is as good as gone.
inline constexpr MonoNs kWriteTimeout = kSecond;

struct SerialSettings {
  std::string path;            // a tty, a pty, or a link to one (/dev/serial/by-id/...)
  LineFormat format;           // of every Open; a pty carries 8 bits without parity, whatever stands here
  bool low_latency = true;     // asks the driver for 1 ms latency where it can
  std::string sysfs = "/sys";  // tests bring their own
  PtyStatement pty = {};
};

// A tty or pty that this process has claimed: what is the same for all ports that sit on one. Every error
// contains its cause and the operator's remedy.
class Tty {
 public:
  Tty(SerialSettings settings, const Clock& clock) : settings_(std::move(settings)), clock_(clock) {}

  // Opens it, refuses what is not the line (line_guard.h), and sets it raw before anything else, so that the echo of a
  // terminal sends nothing back to the devices. Then locks it against a second user of ours (flock), and judges the
  // adapter behind it.
  [[nodiscard]] Result<> Claim();
  void Release() { line_.Reset(); }
  [[nodiscard]] bool IsClaimed() const { return line_.valid(); }
  [[nodiscard]] int FileDescriptor() const { return line_.get(); }
  [[nodiscard]] bool IsPty() const;
  // Whether `fd` is the same line: the path may lead elsewhere since Claim.
  [[nodiscard]] bool IsBehind(int fd) const;

  // Refuses every further open(2) of the line, by whomever but root (TIOCEXCL), and allows it again.
  [[nodiscard]] Result<> Exclude();
  [[nodiscard]] bool Admit();

  // Sets the settings' format, raw, at any rate (BOTHER), and reads back whether it holds.
  [[nodiscard]] Result<> SetFormat();
  // Checks the format that another has set, raw; makes a read of nothing tell itself from a hang-up (VMIN 1).
  [[nodiscard]] Result<> AdoptFormat(const LineFormat& format);
  // Another rate from now on, once all is sent; false when the adapter or the driver does not make it.
  [[nodiscard]] bool ChangeBaud(std::int64_t baud);
  // The same for rate, parity and stop bits.
  [[nodiscard]] bool ChangeFormat(const LineFormat& format);
  [[nodiscard]] bool CanMake(std::int64_t baud) const;
  // Returns when all that was written is on the wire; false when the line takes nothing.
  [[nodiscard]] bool Drain();
  // Drops what has not been read or sent, and counts errors anew.
  [[nodiscard]] Result<> Reset();

  [[nodiscard]] ByteLink::LineErrors Errors() const;  // since Reset
  [[nodiscard]] const SerialSettings& settings() const { return settings_; }
  // What Claim found wanting (a slow latency timer, an adapter that cannot quite reach the rate), with remedies.
  [[nodiscard]] const std::vector<std::string>& warnings() const { return warnings_; }

  // The error of a system call on this port.
  [[nodiscard]] tl::unexpected<Error> OpenFailure(int error) const;

 private:
  [[nodiscard]] Result<Descriptor> OpenLine() const;
  [[nodiscard]] Result<> CheckHardware();
  [[nodiscard]] Result<> Apply(const LineFormat& format);
  [[nodiscard]] Result<> CheckFormat(const LineFormat& format) const;
  [[nodiscard]] ByteLink::LineErrors Counted() const;

  SerialSettings settings_;
  const Clock& clock_;
  Descriptor line_;
  ByteLink::LineErrors at_start_;
  std::vector<std::string> warnings_;
};

// A serial port or pty as a raw line of bytes, locked against a second user. After kLost, or a
// Write that returned false, Close and Open again: the adapter or pty may have come back under the same path.
// Every Open begins at the settings' rate. One thread uses it; Wake may be called from any.
class SerialPort final : public ByteLink {
 public:
  SerialPort(SerialSettings settings, const Clock& clock);
  ~SerialPort() override;
  SerialPort(const SerialPort&) = delete;
  SerialPort& operator=(const SerialPort&) = delete;

  [[nodiscard]] Result<> Open() override;
  void Close() override;
  [[nodiscard]] bool IsOpen() const override { return reader_.IsAttached(); }
  // What was written goes out at the old rate first.
  [[nodiscard]] bool SetBaud(std::int64_t baud) override { return IsOpen() && tty_.ChangeBaud(baud); }
  [[nodiscard]] bool SetFormat(const LineFormat& format) { return IsOpen() && tty_.ChangeFormat(format); }
  [[nodiscard]] bool HasWire() const override { return !tty_.IsPty(); }
  [[nodiscard]] bool Write(Bytes bytes) override;
  [[nodiscard]] ReadResult Read(std::span<std::uint8_t> into, MonoNs deadline) override {
    return reader_.Read(into, deadline);
  }
  [[nodiscard]] ReadResult ReadNow(std::span<std::uint8_t> into) override { return reader_.ReadNow(into); }
  [[nodiscard]] Status Wait(MonoNs until) override { return reader_.Wait(until); }
  void Wake() override { reader_.Wake(); }
  [[nodiscard]] LineErrors Errors() const override { return tty_.Errors(); }

  // What the last successful Open found wanting, each with its remedy.
  [[nodiscard]] const std::vector<std::string>& warnings() const { return tty_.warnings(); }

 private:
  const Clock& clock_;
  Tty tty_;
  LineReader reader_;
};

}  // namespace axlecast
