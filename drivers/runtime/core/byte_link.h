#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <string>

#include "drivers/runtime/core/inline_bytes.h"
#include "drivers/runtime/core/instant.h"

namespace axlecast {

// A line that carries bytes both ways. drivers/io/serial_port.h is the real one; tests script theirs.
class ByteLink {
 public:
  enum class Status : std::uint8_t {
    kOk,       // `count` bytes came
    kTimeout,  // the deadline passed
    kWoken,    // Wake() was called from another thread
    kLost,     // the line is gone: close it, back off, open it again
  };
  struct ReadResult {
    Status status = Status::kTimeout;
    std::size_t count = 0;
  };

  virtual ~ByteLink() = default;

  // Opens the line; an empty string when it is open, else the cause and the remedy for the operator.
  [[nodiscard]] virtual std::string Open() = 0;
  virtual void Close() = 0;
  [[nodiscard]] virtual bool IsOpen() const = 0;

  // Goes on at another rate, without closing; false when the port cannot.
  [[nodiscard]] virtual bool SetBaud(std::int64_t baud) = 0;

  // Hands all bytes to the line; false when it is lost.
  [[nodiscard]] virtual bool Write(Bytes bytes) = 0;

  // Waits for bytes until `deadline` and reads what is there. Does not return kWoken.
  [[nodiscard]] virtual ReadResult Read(std::span<std::uint8_t> into, MonoNs deadline) = 0;

  // Reads what has come without waiting; kTimeout when nothing has.
  [[nodiscard]] virtual ReadResult ReadNow(std::span<std::uint8_t> into) = 0;

  // Sleeps until `until`, until bytes come (kOk, count 0) or until Wake (kWoken). Works on a closed link too.
  [[nodiscard]] virtual Status Wait(MonoNs until) = 0;
  virtual void Wake() = 0;  // from any thread

  // Characters that the line or the driver reported as damaged or lost since Open, where it tells; else 0.
  struct LineErrors {
    std::int64_t framing = 0;
    std::int64_t dropped = 0;
  };
  [[nodiscard]] virtual LineErrors Errors() const = 0;
};

}  // namespace axlecast
