#pragma once

#include <algorithm>
#include <array>
#include <axlecast/bus_health_t.hpp>
#include <cstdint>
#include <map>
#include <string>

#include "core/device/reading.h"

namespace axlecast {

// A damaged message may say anything: no counter, and no sum of counters, is believed beyond this.
inline constexpr std::int64_t kMaxCounts = std::int64_t{1} << 50;

// How far a counter has risen; 0 where it has not.
[[nodiscard]] constexpr std::int64_t Growth(std::int64_t before, std::int64_t now) {
  const auto believed = [](std::int64_t counts) { return std::clamp<std::int64_t>(counts, 0, kMaxCounts); };
  return std::max<std::int64_t>(believed(now) - believed(before), 0);
}

// Failed exchanges of each bus over time, from BUS messages: of a cable and its adapter the trend tells more than the
// count. Counters begin anew with each start of a driver. Pure.
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
    std::map<std::int64_t, Entry> entries;  // by the beginning of their span, us UNIX
    std::int64_t boot_id = 0;
    std::int64_t seq = -1;
    Entry counted;  // as the newest message says
  };
  [[nodiscard]] const std::map<std::string, Bus>& buses() const { return buses_; }

 private:
  std::map<std::string, Bus> buses_;
};

// "timeout 3, checksum 1"; "none".
[[nodiscard]] std::string KindsText(const std::array<std::int64_t, kErrorKinds>& errors);

}  // namespace axlecast
