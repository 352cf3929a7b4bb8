#pragma once

#include <cstdint>
#include <string>

#include "core/base/time.h"

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

}  // namespace axlecast
