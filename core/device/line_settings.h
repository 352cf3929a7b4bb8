#pragma once

#include <cstddef>
#include <cstdint>
#include <string>

#include "core/base/inline_bytes.h"
#include "core/base/time.h"

namespace axlecast {

enum class Parity : std::uint8_t { kNone, kEven, kOdd };

// The format of characters on an asynchronous line: one start bit, 8 data bits, LSB first.
struct LineFormat {
  std::int64_t baud = 0;
  Parity parity = Parity::kNone;
  int stop_bits = 1;

  [[nodiscard]] constexpr int BitsPerCharacter() const {
    return 1 + 8 + (parity == Parity::kNone ? 0 : 1) + stop_bits;
  }
  // Returns the time of `characters` on the wire; 0 if the rate is unknown.
  [[nodiscard]] constexpr MonoNs WireTime(std::size_t characters) const {
    return baud == 0 ? 0 : static_cast<MonoNs>(characters) * BitsPerCharacter() * kSecond / baud;
  }
  // The shortest time of one character: a rate may be 3 % off (an adapter's divider, +1.05 % at 2.5 MBd; both clocks).
  [[nodiscard]] constexpr MonoNs ShortestCharacter() const { return WireTime(1) * 97 / 100; }
};

// The pauses that the devices of a bus require from their master, in addition to the exchange itself.
struct Pacing {
  MonoNs after_request = 0;     // bus-wide, from the end of a request on the wire to the next request
  MonoNs after_reply = 0;       // bus-wide, from the end of a reply, or of the wait for it, to the next request
  MonoNs unit_after_reply = 0;  // as after_reply, between two requests to the same device

  friend constexpr bool operator==(const Pacing&, const Pacing&) = default;
};

// The clock settings of an SPI bus for one device. Words have 8 bits, because many controllers support no others.
struct SpiSettings {
  int mode = 0;               // 0 to 3: CPOL * 2 + CPHA; bit 1: the clock idles high
  std::int64_t clock_hz = 0;  // at most; the controller takes the nearest rate below that it has

  // Returns the time of this number of clocks.
  [[nodiscard]] constexpr MonoNs ClockTime(std::int64_t clocks) const {
    return clock_hz == 0 ? 0 : clocks * kSecond / clock_hz;
  }
  friend constexpr bool operator==(const SpiSettings&, const SpiSettings&) = default;
};

// One transfer as a device on the bus sees it.
struct SpiTransfer {
  SpiSettings settings;
  int bits_per_word = 8;
  Bytes tx;  // as many bytes are clocked in
};

// One output line beside the bus (a GPIO), idle high, known to the device by its place in FamilyBus::lines.
struct PulseLineConfig {
  std::string name;  // as the family calls it, e.g. "clk"
  std::string chip;  // e.g. /dev/gpiochip0
  int offset = 0;    // of the line on its chip
};

}  // namespace axlecast
