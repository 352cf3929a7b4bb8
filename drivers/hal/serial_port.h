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

// A line that accepts no byte for this time is regarded as lost.
inline constexpr MonoNs kWriteTimeout = kSecond;

struct SerialSettings {
  std::string path;            // a tty, a pty, or a link to one (/dev/serial/by-id/...)
  LineFormat format;           // set by every Open; a pty always has 8 bits without parity
  bool low_latency = true;     // request a latency of 1 ms from the driver, if it supports that
  std::string sysfs = "/sys";  // replaced by tests
  PtyStatement pty = {};
};

// A tty or pty that this process has claimed: the common part of SerialPort and ModbusPort. Every error contains the cause and
// the remedy.
class Tty {
 public:
  Tty(SerialSettings settings, const Clock& clock) : settings_(std::move(settings)), clock_(clock) {}

  // Opens the line, and refuses a terminal that is not the line (line_guard.h). Sets it raw first, so that no echo is sent to
  // the devices. Then locks it against other axlecast processes (flock), and checks the adapter.
  [[nodiscard]] Result<> Claim();
  void Release() {
    blocking_.Reset();
    line_.Reset();
  }
  [[nodiscard]] int FileDescriptor() const { return line_.get(); }
  // Returns a path that leads to the claimed line. The path of the settings may lead to another one since Claim.
  [[nodiscard]] std::string OpenPath() const;
  // Opens the claimed line a second time, without O_NONBLOCK; call it before Exclude. Release closes it. Returns -1 if that fails.
  [[nodiscard]] int OpenBlocking();
  [[nodiscard]] bool IsPty() const;
  // Returns true if `fd` is the claimed line. The path may lead to another one since Claim.
  [[nodiscard]] bool IsBehind(int fd) const;

  // Refuses further open(2) of the line, except by root (TIOCEXCL). Admit allows it again.
  [[nodiscard]] Result<> Exclude();
  [[nodiscard]] bool Admit();

  // Sets a format, raw, at any rate (BOTHER), and reads it back.
  [[nodiscard]] Result<> SetFormat(const LineFormat& format);
  // Checks the raw format that libmodbus has set. Sets VMIN 1, so that a read of nothing differs from a hang-up.
  [[nodiscard]] Result<> AdoptFormat(const LineFormat& format);
  // Sends all bytes, then sets another format. Returns false if the adapter or the driver does not support it.
  [[nodiscard]] bool ChangeFormat(const LineFormat& format) {
    return CanMake(format.baud) && Drain() && SetFormat(format).has_value();
  }
  [[nodiscard]] bool CanMake(std::int64_t baud) const;
  // Returns when all written bytes are on the wire, or false if the line accepts nothing.
  [[nodiscard]] bool Drain();
  // Drops what was not read or sent, and restarts the error counts.
  [[nodiscard]] Result<> Reset();

  [[nodiscard]] ByteLink::LineErrors Errors() const;  // since Reset
  [[nodiscard]] const SerialSettings& settings() const { return settings_; }
  // Warnings of Claim, with remedies: a slow latency timer, or an adapter that does not reach the rate exactly.
  [[nodiscard]] const std::vector<std::string>& warnings() const { return warnings_; }

  // The error of a system call on this port.
  [[nodiscard]] tl::unexpected<Error> OpenFailure(int error) const;

 private:
  [[nodiscard]] Result<Descriptor> OpenLine() const;
  [[nodiscard]] Result<> CheckHardware();
  [[nodiscard]] Result<> CheckFormat(const LineFormat& format) const;
  [[nodiscard]] ByteLink::LineErrors Counted() const;

  SerialSettings settings_;
  const Clock& clock_;
  Descriptor line_;
  Descriptor blocking_;
  ByteLink::LineErrors at_start_;
  std::vector<std::string> warnings_;
};

// A line of bytes on a tty: the common part of SerialPort and ModbusPort.
class TtyPort : public ByteLink {
 public:
  [[nodiscard]] bool IsOpen() const override { return reader_.IsAttached(); }
  [[nodiscard]] bool HasWire() const override { return !tty_.IsPty(); }
  [[nodiscard]] ReadResult Read(std::span<std::uint8_t> into, MonoNs deadline) override {
    return reader_.Read(into, deadline);
  }
  [[nodiscard]] ReadResult ReadNow(std::span<std::uint8_t> into) override { return reader_.ReadNow(into); }
  [[nodiscard]] Status Wait(MonoNs until) override { return reader_.Wait(until); }
  void Wake() override { reader_.Wake(); }
  [[nodiscard]] LineErrors Errors() const override { return tty_.Errors(); }

  // Warnings of the last successful Open, each with its remedy.
  [[nodiscard]] const std::vector<std::string>& warnings() const { return tty_.warnings(); }

 protected:
  TtyPort(SerialSettings settings, const Clock& clock)
      : clock_(clock), tty_(std::move(settings), clock), reader_(clock) {}

  const Clock& clock_;
  Tty tty_;
  LineReader reader_;
};

// A serial port or pty as a raw line of bytes, locked against a second user. After kLost, or after Write returned false, call
// Close and Open again: the adapter or pty may be available again under the same path. Open sets the rate of the settings.
// Used by one thread, except Wake.
class SerialPort final : public TtyPort {
 public:
  SerialPort(SerialSettings settings, const Clock& clock) : TtyPort(std::move(settings), clock) {}

  [[nodiscard]] Result<> Open() override;
  void Close() override;
  // Written bytes are sent at the old rate first.
  [[nodiscard]] bool SetBaud(std::int64_t baud) override {
    LineFormat format = tty_.settings().format;
    format.baud = baud;
    return SetFormat(format);
  }
  [[nodiscard]] bool SetFormat(const LineFormat& format) { return IsOpen() && tty_.ChangeFormat(format); }
  [[nodiscard]] bool Write(Bytes bytes) override;
};

}  // namespace axlecast
