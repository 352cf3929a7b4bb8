#pragma once

#include <cstdint>

#include "core/base/inline_bytes.h"
#include "core/base/time.h"

namespace axlecast {

// How an SPI bus is clocked for one device. Words have 8 bits: many controllers know no others.
struct SpiSettings {
  int mode = 0;               // 0 to 3: CPOL * 2 + CPHA; bit 1: the clock idles high
  std::int64_t clock_hz = 0;  // at most; the controller takes the nearest rate below that it has

  // Time of so many clocks.
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

}  // namespace axlecast
