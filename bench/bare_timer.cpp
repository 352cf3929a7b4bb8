// The peer of the replay's timing: a bare timer. Sleeps to absolute instants and publishes, as a program without any
// setting does.
//
// bare_timer URL MESSAGES PERIOD_US BYTES

#include <cstdio>
#include <cstdlib>
#include <lcm/lcm-cpp.hpp>
#include <vector>

#include "bench/monotonic.h"

int main(int argc, char** argv) {
  using axlecast::bench::MonotonicNow;
  if (argc != 5) {
    std::fprintf(stderr, "usage: bare_timer URL MESSAGES PERIOD_US BYTES\n");
    return 2;
  }
  lcm::LCM lcm(argv[1]);
  if (!lcm.good()) return 1;
  const std::int64_t messages = std::atoll(argv[2]);
  const std::int64_t period_us = std::atoll(argv[3]);
  std::vector<std::uint8_t> data(static_cast<std::size_t>(std::atoll(argv[4])));
  if (data.size() < 8) return 2;
  const std::int64_t begin = MonotonicNow() + 10'000'000;
  for (std::int64_t i = 0; i < messages; ++i) {
    const std::int64_t at_us = i * period_us;
    for (std::size_t k = 0; k < 8; ++k) data[k] = static_cast<std::uint8_t>(at_us >> (56 - 8 * k));
    axlecast::bench::SleepUntil(begin + at_us * 1'000);
    if (lcm.publish("REPLAY", data.data(), static_cast<unsigned>(data.size())) != 0) return 1;
  }
  return 0;
}
