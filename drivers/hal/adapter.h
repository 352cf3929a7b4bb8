#pragma once

#include <cstdint>
#include <optional>
#include <string>

#include "core/base/result.h"

namespace axlecast {

// A USB serial adapter, from its USB descriptor.
struct UsbAdapter {
  std::uint16_t vendor = 0;
  std::uint16_t product = 0;
  std::uint16_t release = 0;  // bcdDevice; FTDI: the chip type
};

// Whether the chip of an adapter supports a rate. termios does not report that: it returns the requested rate.
struct AdapterVerdict {
  bool fits = true;  // false: more than 2 % off; frames would be lost
  double baud = 0;   // the rate that the chip produces; 0: unknown
  std::string text;  // a warning for the operator, or nothing
};
[[nodiscard]] AdapterVerdict CheckAdapter(const UsbAdapter& adapter, std::int64_t baud);

// The entries of a tty in sysfs. Ports that are not USB adapters have none.
struct TtyFacts {
  std::optional<UsbAdapter> usb;
  std::string latency_timer;  // path of the latency timer of the driver, in ms, if it has one
};
// Reads them for a device number.
[[nodiscard]] TtyFacts ReadTtyFacts(const std::string& sysfs, unsigned major, unsigned minor);

// Reads them for a path, even if another process holds the line. Returns nothing if the path does not lead to a tty.
[[nodiscard]] std::optional<TtyFacts> ReadTtyFacts(const std::string& path);
// In ms; -1: unknown.
[[nodiscard]] int ReadLatency(const std::string& latency_timer);

// Sets the latency timer to 1 ms. With the usual 16 ms, a bus can do about 62 exchanges per second. The error contains the cause
// and the commands to type.
[[nodiscard]] Result<> ShortenLatency(const std::string& latency_timer);

}  // namespace axlecast
