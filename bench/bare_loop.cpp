// The peer of the exchange benchmarks: what an engineer would write by hand in an afternoon. Write one byte, block
// in read until eleven have come, publish. No time-outs, no checks, no alarms, no plausibility.
//
// bare_loop PORT URL SECONDS [PERIOD_US]
//
// Publishes as the driver under test does: POSITION at up to 1 kHz and every reading in POSITION_BLOCK messages
// of 40. PERIOD_US > 0 polls in absolute slots; 0 as fast as replies come. Prints one JSON object.

#include <sys/resource.h>
#include <unistd.h>

#include <axlecast/position_block_t.hpp>
#include <axlecast/position_t.hpp>
#include <cstdio>
#include <cstdlib>
#include <lcm/lcm-cpp.hpp>

#include "bench/monotonic.h"
#include "bench/raw_port.h"

namespace {

using axlecast::bench::MonotonicNow;
using axlecast::bench::OpenRaw;
using axlecast::bench::SleepUntil;

bool Exchange(int port, std::uint8_t* reply) {
  const std::uint8_t request = 0x1A;
  if (write(port, &request, 1) != 1) return false;
  std::size_t count = 0;
  while (count < 11) {
    const ssize_t got = read(port, reply + count, 11 - count);
    if (got <= 0) return false;
    count += static_cast<std::size_t>(got);
  }
  return true;
}

class Publisher {
 public:
  explicit Publisher(const char* url) : lcm_(url) { block_.counts_per_turn = position_.counts_per_turn = 131'072; }

  void Take(std::int64_t at, const std::uint8_t* reply) {
    const std::int64_t counts = reply[2] | reply[3] << 8 | reply[4] << 16;
    if (block_.n == 0) block_.mono_ns = at;
    block_.dt_ns.push_back(static_cast<std::int32_t>(at - block_.mono_ns));
    block_.time_uncertainty_ns.push_back(0);
    block_.counts.push_back(counts);
    block_.flags.push_back(1);
    if (++block_.n == axlecast::position_block_t::MAX_SAMPLES) Flush();
    if (at - position_.mono_ns < 999'000) return;
    position_.mono_ns = at;
    position_.raw_counts = position_.counts = counts;
    position_.value = static_cast<double>(counts) / 131'072;
    ++position_.seq;
    lcm_.publish("POSITION/axis1", &position_);
  }

 private:
  void Flush() {
    ++block_.seq;
    lcm_.publish("POSITION_BLOCK/axis1", &block_);
    block_.n = 0;
    block_.dt_ns.clear();
    block_.time_uncertainty_ns.clear();
    block_.counts.clear();
    block_.flags.clear();
  }

  lcm::LCM lcm_;
  axlecast::position_t position_{};
  axlecast::position_block_t block_{};
};

}  // namespace

int main(int argc, char** argv) {
  if (argc < 4) {
    std::fprintf(stderr, "usage: bare_loop PORT URL SECONDS [PERIOD_US]\n");
    return 2;
  }
  const int port = OpenRaw(argv[1]);
  if (port < 0) {
    std::perror(argv[1]);
    return 1;
  }
  const std::int64_t period = (argc > 4 ? std::atoll(argv[4]) : 0) * 1'000;
  Publisher publisher(argv[2]);
  const std::int64_t start = MonotonicNow();
  const std::int64_t end = start + static_cast<std::int64_t>(std::atof(argv[3]) * 1e9);
  std::int64_t exchanges = 0;
  std::int64_t slot = start;
  for (std::int64_t now = start; now < end; now = MonotonicNow()) {
    if (period > 0) SleepUntil(slot += period);
    std::uint8_t reply[11];
    const std::int64_t at = MonotonicNow();
    if (!Exchange(port, reply)) return 1;
    publisher.Take(at, reply);
    ++exchanges;
  }
  rusage usage{};
  getrusage(RUSAGE_SELF, &usage);
  const auto seconds = [](const timeval& time) {
    return static_cast<double>(time.tv_sec) + static_cast<double>(time.tv_usec) * 1e-6;
  };
  std::printf("{\"exchanges\": %lld, \"seconds\": %.6f, \"cpu_s\": %.6f}\n", static_cast<long long>(exchanges),
              static_cast<double>(MonotonicNow() - start) * 1e-9,
              seconds(usage.ru_utime) + seconds(usage.ru_stime));
  return 0;
}
