#pragma once

#include <cstdint>
#include <optional>
#include <string>

namespace axlecast {

// A USB serial adapter as its USB descriptor names it.
struct UsbAdapter {
  std::uint16_t vendor = 0;
  std::uint16_t product = 0;
  std::uint16_t release = 0;  // bcdDevice: at FTDI the chip type
};

// Whether the adapter's chip makes the rate. termios cannot tell: it returns the rate that was asked for.
struct AdapterVerdict {
  bool fits = true;  // false: more than 2 % off, frames get lost
  double baud = 0;   // the rate that the chip makes; 0 unknown
  std::string text;  // what the operator should know, empty when there is nothing
};
[[nodiscard]] AdapterVerdict JudgeAdapter(const UsbAdapter& adapter, std::int64_t baud);

// What sysfs tells of the tty with this device number. Ports that are no USB adapters have neither.
struct TtyFacts {
  std::optional<UsbAdapter> usb;
  std::string latency_timer;  // path of the driver's latency timer in ms, where it has one
};
[[nodiscard]] TtyFacts ReadTtyFacts(const std::string& sysfs, unsigned major, unsigned minor);

// The same of a path, whoever holds the line; nothing where it leads to no tty.
[[nodiscard]] std::optional<TtyFacts> ReadTtyFacts(const std::string& path);
// In ms; -1: not told.
[[nodiscard]] int ReadLatency(const std::string& latency_timer);

// Sets the latency timer to 1 ms: at the usual 16 ms a bus makes about 62 exchanges a second. An empty string when
// it is 1 ms now, else the cause and the lines that mend it.
[[nodiscard]] std::string ShortenLatency(const std::string& latency_timer);

}  // namespace axlecast
