#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <string_view>

#include "core/base/inline_bytes.h"
#include "core/base/result.h"
#include "core/base/time.h"
#include "core/device/can.h"

namespace axlecast {

// A line of a bus: it can be opened, closed, reopened and waited on. ByteLink and FrameLink add sending and receiving.
// drivers/hal implements real lines; tests use scripted ones.
class Link {
 public:
  enum class Status : std::uint8_t {
    kOk,       // something came
    kTimeout,  // the deadline passed
    kWoken,    // Wake() was called from another thread
    kLost,     // the line is gone: close it, back off, open it again
  };

  Link() = default;
  virtual ~Link() = default;
  Link(const Link&) = delete;
  Link& operator=(const Link&) = delete;

  // Opens the line. The error contains the cause and the remedy for the operator.
  [[nodiscard]] virtual Result<> Open() = 0;
  virtual void Close() = 0;
  [[nodiscard]] virtual bool IsOpen() const = 0;

  // Sleeps until `until`, until something comes (kOk) or until Wake (kWoken). Works on a closed link too.
  [[nodiscard]] virtual Status Wait(MonoNs until) = 0;
  virtual void Wake() = 0;  // from any thread

  // Errors that the line or the kernel has reported since Open; 0 if it does not report them.
  struct LineErrors {
    std::int64_t framing = 0;  // damaged characters; on CAN, error frames of the bus
    std::int64_t dropped = 0;  // received and lost because a buffer was full
  };
  [[nodiscard]] virtual LineErrors Errors() const = 0;
};

// A line that carries bytes in both directions: serial (drivers/hal/serial_port.h) or SPI. On SPI, Read returns the bytes that
// were clocked in during Write (drivers/hal/spi_port.h).
class ByteLink : public Link {
 public:
  struct ReadResult {
    Status status = Status::kTimeout;
    std::size_t count = 0;
  };

  // Changes the baud rate without closing the line. Returns false if the port does not support the rate.
  [[nodiscard]] virtual bool SetBaud(std::int64_t baud) = 0;

  // Returns false if bytes may arrive faster than the baud rate allows: a pseudo-terminal.
  [[nodiscard]] virtual bool HasWire() const { return true; }

  // Writes all bytes to the line. Returns false if the line is lost.
  [[nodiscard]] virtual bool Write(Bytes bytes) = 0;

  // Waits for bytes until `deadline` and reads the available ones. Does not return kWoken.
  [[nodiscard]] virtual ReadResult Read(std::span<std::uint8_t> into, MonoNs deadline) = 0;

  // Reads the available bytes without waiting. Returns kTimeout if there are none.
  [[nodiscard]] virtual ReadResult ReadNow(std::span<std::uint8_t> into) = 0;
};

// A line that carries CAN frames. drivers/hal/can_socket.h is the real one.
class FrameLink : public Link {
 public:
  enum class SendResult : std::uint8_t {
    kQueued,  // it is sent when the bus is free; Receive reports it when a node has acknowledged it
    kFull,    // the interface's queue is full, and the frame is not in it
    kLost,    // as Status::kLost
  };
  [[nodiscard]] virtual SendResult Send(const CanFrame& frame) = 0;

  struct Received {
    CanFrame frame;
    Interval at;       // contains the arrival time, from the kernel
    bool own = false;  // a frame of this link that a node has acknowledged
  };
  // Reads the next frame without waiting. Returns kOk, kTimeout or kLost.
  [[nodiscard]] virtual Status Receive(Received& received) = 0;

  // Queries the kernel, which may take some 10 us.
  [[nodiscard]] virtual CanController Controller() = 0;
};

// Output lines beside a bus. drivers/hal/gpio_line.h drives real ones.
class PulseLines {
 public:
  PulseLines() = default;
  virtual ~PulseLines() = default;
  PulseLines(const PulseLines&) = delete;
  PulseLines& operator=(const PulseLines&) = delete;

  // Claims all lines and drives them high. The error contains the cause and the remedy.
  [[nodiscard]] virtual Result<> Open() = 0;
  virtual void Close() = 0;
  // Drives the line low for at least `low`, then high again. False when that could not be done.
  [[nodiscard]] virtual bool Pulse(std::uint8_t line, MonoNs low) = 0;
};

// The end of the error of Link::Open while another process holds the line. A driver whose line stays held ends with this
// error, and adds the name of the process.
inline constexpr std::string_view kLineHeld =
    "another process holds it: end it (is a second driver running?), or correct the port of this bus";

}  // namespace axlecast
