#pragma once

#include <string>

#include "core/base/time.h"
#include "core/device/line_settings.h"
#include "core/device/link.h"
#include "drivers/hal/line_reader.h"
#include "platform/os/descriptor.h"

namespace axlecast {

// One chip select of an SPI bus, through spidev, locked against other axlecast processes. Words of 8 bits, most significant bit
// first. After Write returned false, call Close and Open again. Used by one thread, except Wake.
class SpiPort final : public ByteLink {
 public:
  // `path`: a spidev, e.g. /dev/spidev0.0.
  SpiPort(std::string path, SpiSettings settings, const Clock& clock)
      : path_(std::move(path)), settings_(settings), clock_(clock), waiter_(clock) {}

  // Sets mode, word and clock, and reads them back.
  [[nodiscard]] Result<> Open() override;
  void Close() override;
  [[nodiscard]] bool IsOpen() const override { return device_.valid(); }
  [[nodiscard]] bool SetBaud(std::int64_t) override { return false; }
  // Transfers all bytes, at most kMaxFrame, while the chip stays selected. The bytes clocked in can be read afterwards.
  [[nodiscard]] bool Write(Bytes bytes) override;
  // Waits until `deadline` if no bytes were clocked in.
  [[nodiscard]] ReadResult Read(std::span<std::uint8_t> into, MonoNs deadline) override;
  [[nodiscard]] ReadResult ReadNow(std::span<std::uint8_t> into) override;
  [[nodiscard]] Status Wait(MonoNs until) override;
  void Wake() override { waiter_.Wake(); }
  [[nodiscard]] LineErrors Errors() const override { return {}; }

 private:
  [[nodiscard]] Result<> Claim();
  [[nodiscard]] Result<> SetMode() const;
  [[nodiscard]] Result<> SetWord() const;
  [[nodiscard]] Result<> SetClock() const;
  [[nodiscard]] tl::unexpected<Error> OpenFailure(int error) const;

  const std::string path_;
  const SpiSettings settings_;
  const Clock& clock_;
  Descriptor device_;
  LineReader waiter_;  // not attached: a spidev cannot be polled
  ClockedIn clocked_in_;
};

}  // namespace axlecast
