#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <string_view>

#include "core/base/inline_bytes.h"
#include "core/base/time.h"
#include "core/device/can.h"

namespace axlecast {

// What carries a bus, whatever goes over it: opened, closed and opened again, waited on. ByteLink and FrameLink say
// what is sent and received. drivers/hal has the real ones; tests script theirs.
class Link {
 public:
  enum class Status : std::uint8_t {
    kOk,       // something came
    kTimeout,  // the deadline passed
    kWoken,    // Wake() was called from another thread
    kLost,     // the line is gone: close it, back off, open it again
  };

  virtual ~Link() = default;

  // Opens the line; an empty string when it is open, else the cause and the remedy for the operator.
  [[nodiscard]] virtual std::string Open() = 0;
  virtual void Close() = 0;
  [[nodiscard]] virtual bool IsOpen() const = 0;

  // Sleeps until `until`, until something comes (kOk) or until Wake (kWoken). Works on a closed link too.
  [[nodiscard]] virtual Status Wait(MonoNs until) = 0;
  virtual void Wake() = 0;  // from any thread

  // What the line or the kernel reported as damaged or lost since Open, where it tells; else 0.
  struct LineErrors {
    std::int64_t framing = 0;  // damaged characters; on CAN, error frames of the bus
    std::int64_t dropped = 0;  // received and lost for want of room
  };
  [[nodiscard]] virtual LineErrors Errors() const = 0;
};

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

// A line that carries CAN frames. drivers/hal/can_socket.h is the real one.
class FrameLink : public Link {
 public:
  enum class SendResult : std::uint8_t {
    kQueued,  // it goes out when the bus is free; Receive tells of it when some node has acknowledged it
    kFull,    // the interface's queue is full, and the frame is not in it
    kLost,    // as Status::kLost
  };
  [[nodiscard]] virtual SendResult Send(const CanFrame& frame) = 0;

  struct Received {
    CanFrame frame;
    Interval at;       // holds the instant at which it had arrived, as the kernel saw it
    bool own = false;  // one that this link sent was on the bus, and a node has acknowledged it
  };
  // The next of what has come, without waiting: kOk, kTimeout or kLost.
  [[nodiscard]] virtual Status Receive(Received& received) = 0;

  // Asks the kernel; may take some 10 us.
  [[nodiscard]] virtual CanController Controller() = 0;
};

// Output lines beside a bus. drivers/hal/gpio_line.h drives real ones.
class PulseLines {
 public:
  virtual ~PulseLines() = default;

  // Claims all lines and drives them high; an empty string when done, else the cause and the remedy.
  [[nodiscard]] virtual std::string Open() = 0;
  virtual void Close() = 0;
  // Drives the line low for at least `low`, then high again. False when that could not be done.
  [[nodiscard]] virtual bool Pulse(std::uint8_t line, MonoNs low) = 0;
};

// How the answer of Link::Open ends while another process has the line: a serial or Modbus port, an SPI device, a CAN interface,
// an output line. A driver whose line stays held ends with it (driver.h), and adds the name of the process.
inline constexpr std::string_view kLineHeld =
    "another process holds it: end that one (is a second driver running?), or correct the port of this bus";

}  // namespace axlecast
