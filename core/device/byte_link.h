#pragma once

#include <cstddef>
#include <cstdint>
#include <span>

#include "core/base/inline_bytes.h"
#include "core/device/link.h"

namespace axlecast {

// A line that carries bytes both ways: serial (drivers/hal/serial_port.h) or SPI, where what was clocked in waits to be
// read once Write has clocked out (drivers/hal/spi_port.h).
class ByteLink : public Link {
 public:
  struct ReadResult {
    Status status = Status::kTimeout;
    std::size_t count = 0;
  };

  // Goes on at another rate, without closing; false when the port cannot.
  [[nodiscard]] virtual bool SetBaud(std::int64_t baud) = 0;

  // False where bytes may come faster than the rate says: a pty.
  [[nodiscard]] virtual bool HasWire() const { return true; }

  // Hands all bytes to the line; false when it is lost.
  [[nodiscard]] virtual bool Write(Bytes bytes) = 0;

  // Waits for bytes until `deadline` and reads what is there. Does not return kWoken.
  [[nodiscard]] virtual ReadResult Read(std::span<std::uint8_t> into, MonoNs deadline) = 0;

  // Reads what has come without waiting; kTimeout when nothing has.
  [[nodiscard]] virtual ReadResult ReadNow(std::span<std::uint8_t> into) = 0;
};

}  // namespace axlecast
