#pragma once

#include <algorithm>
#include <array>
#include <axlecast/bus_health_t.hpp>
#include <cstdint>
#include <map>
#include <string>

#include "core/device/reading.h"

namespace axlecast {

// The maximum accepted value of a counter and of a sum: a damaged message may contain any value.
inline constexpr std::int64_t kMaxCounts = std::int64_t{1} << 50;

// Returns the increase of a counter; 0 if it has not increased.
[[nodiscard]] constexpr std::int64_t Growth(std::int64_t before, std::int64_t now) {
  const auto clamped = [](std::int64_t counts) { return std::clamp<std::int64_t>(counts, 0, kMaxCounts); };
  return std::max<std::int64_t>(clamped(now) - clamped(before), 0);
}

// Failed exchanges of each bus over time, from BUS messages. For a cable and its adapter, the trend is more useful than the
// count. Counters restart with each start of a driver. Does no I/O.
class ErrorTrend {
 public:
  static constexpr std::int64_t kSpan = 3'600'000'000;  // us of one entry

  void OnBus(const bus_health_t& health);

  struct Entry {
    std::int64_t exchanges = 0;
    std::array<std::int64_t, kErrorKinds> errors{};
    std::int64_t reopens = 0;
    float p99_us = 0;  // the slowest window

    [[nodiscard]] std::int64_t Failed() const;
  };
  struct Bus {
    std::string port;
    std::map<std::int64_t, Entry> entries;  // by the start of their span, us UNIX
    std::int64_t boot_id = 0;
    std::int64_t seq = -1;
    Entry counted;  // counters of the newest message
  };
  [[nodiscard]] const std::map<std::string, Bus>& buses() const { return buses_; }

 private:
  std::map<std::string, Bus> buses_;
};

// Formats the counters: "timeout 3, checksum 1", or "none".
[[nodiscard]] std::string KindsText(const std::array<std::int64_t, kErrorKinds>& errors);

}  // namespace axlecast
