// The peer of the latency benchmark: bare LCM. Publishes POSITION with the instant just before the call in mono_ns.
//
// bare_publish URL SECONDS [RATE_HZ]

#include <axlecast/position_t.hpp>
#include <cstdio>
#include <cstdlib>
#include <lcm/lcm-cpp.hpp>

#include "bench/monotonic.h"

int main(int argc, char** argv) {
  using axlecast::bench::MonotonicNow;
  const double rate = argc > 3 ? std::atof(argv[3]) : 1'000;
  if (argc < 3 || rate <= 0) {
    std::fprintf(stderr, "usage: bare_publish URL SECONDS [RATE_HZ]\n");
    return 2;
  }
  lcm::LCM lcm(argv[1]);
  if (!lcm.good()) return 1;
  const auto period = static_cast<std::int64_t>(1e9 / rate);
  std::int64_t slot = MonotonicNow();
  const std::int64_t end = slot + static_cast<std::int64_t>(std::atof(argv[2]) * 1e9);
  axlecast::position_t position{};
  for (; slot < end; slot += period) {
    axlecast::bench::SleepUntil(slot);
    position.mono_ns = MonotonicNow();
    if (lcm.publish("POSITION/axis1", &position) != 0) return 1;
    ++position.seq;
  }
  return 0;
}
