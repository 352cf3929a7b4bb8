#pragma once

#include <string>
#include <vector>

#include "drivers/hal/line_reader.h"
#include "drivers/hal/tty.h"

namespace axlecast {

// A serial port or pty as a raw line of bytes, locked against a second user. After kLost, or a
// Write that returned false, Close and Open again: the adapter or pty may have come back under the same path.
// Every Open begins at the settings' rate. One thread uses it; Wake may be called from any.
class SerialPort final : public ByteLink {
 public:
  SerialPort(SerialSettings settings, const Clock& clock);
  ~SerialPort() override;
  SerialPort(const SerialPort&) = delete;
  SerialPort& operator=(const SerialPort&) = delete;

  [[nodiscard]] std::string Open() override;
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
  [[nodiscard]] std::string SetUp();

  const Clock& clock_;
  Tty tty_;
  LineReader reader_;
};

}  // namespace axlecast
