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
class SpiPort final : public ClockedLink {
 public:
  // `path`: a spidev, e.g. /dev/spidev0.0.
  SpiPort(std::string path, SpiSettings settings, const Clock& clock)
      : ClockedLink(std::move(path), settings, clock) {}

  // Sets mode, word and clock, and reads them back.
  [[nodiscard]] Result<> Open() override;
  void Close() override;
  [[nodiscard]] bool IsOpen() const override { return device_.valid(); }
  // Transfers all bytes, at most kMaxFrame, while the chip stays selected. The bytes clocked in can be read afterwards.
  [[nodiscard]] bool Write(Bytes bytes) override;
  // Waits until `deadline` if no bytes were clocked in.
  [[nodiscard]] ReadResult Read(std::span<std::uint8_t> into, MonoNs deadline) override;
  [[nodiscard]] Status Wait(MonoNs until) override;

 private:
  [[nodiscard]] Result<> Claim();
  [[nodiscard]] Result<> SetMode() const;
  [[nodiscard]] Result<> SetWord() const;
  [[nodiscard]] Result<> SetClock() const;
  [[nodiscard]] tl::unexpected<Error> OpenFailure(int error) const;

  Descriptor device_;
};

}  // namespace axlecast
