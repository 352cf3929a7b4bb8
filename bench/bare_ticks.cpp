// The peer of `ticks`: threads with SCHED_FIFO 80 that sleep until a common slot, write one byte and read eleven, one thread for each
// port. No time-outs, no checks, no messages.
//
// bare_ticks SECONDS PERIOD_US PORT...
//
// Prints the distribution over the slots of the hull: from the earliest instant before a write to the latest instant after the first
// read of a reply.

#include <pthread.h>
#include <unistd.h>

#include <algorithm>
#include <atomic>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <thread>
#include <vector>

#include "bench/distribution.h"
#include "bench/monotonic.h"
#include "bench/raw_port.h"

namespace {

using axlecast::bench::MonotonicNow;
using axlecast::bench::OpenRaw;
using axlecast::bench::SleepUntil;

struct Latch {
  std::int64_t earliest = 0;
  std::int64_t latest = 0;
};

bool Exchange(int port, Latch& latch) {
  const std::uint8_t request = 0x1A;
  std::uint8_t reply[11];
  latch.earliest = MonotonicNow();
  if (write(port, &request, 1) != 1) return false;
  std::size_t count = 0;
  while (count < sizeof reply) {
    const ssize_t got = read(port, reply + count, sizeof reply - count);
    if (got <= 0) return false;
    if (count == 0) latch.latest = MonotonicNow();
    count += static_cast<std::size_t>(got);
  }
  return true;
}

void MakeRealtime() {
  const sched_param priority{.sched_priority = 80};
  if (pthread_setschedparam(pthread_self(), SCHED_FIFO, &priority) != 0) {
    std::fprintf(stderr, "bare_ticks: SCHED_FIFO is not permitted\n");
  }
}

}  // namespace

int main(int argc, char** argv) {
  if (argc < 4) {
    std::fprintf(stderr, "usage: bare_ticks SECONDS PERIOD_US PORT...\n");
    return 2;
  }
  const std::int64_t period = std::atoll(argv[2]) * 1'000;
  const auto slots = static_cast<std::size_t>(std::atof(argv[1]) * 1e9 / static_cast<double>(period));
  const std::int64_t first = (MonotonicNow() / period + 100) * period;
  std::vector<std::vector<Latch>> latches(static_cast<std::size_t>(argc - 3), std::vector<Latch>(slots));
  std::atomic<bool> good = true;
  std::vector<std::thread> threads;
  for (std::size_t i = 0; i < latches.size(); ++i) {
    const int port = OpenRaw(argv[3 + i]);
    if (port < 0) {
      std::perror(argv[3 + i]);
      return 1;
    }
    threads.emplace_back([&, i, port] {
      MakeRealtime();
      for (std::size_t slot = 0; slot < slots && good; ++slot) {
        SleepUntil(first + static_cast<std::int64_t>(slot) * period);
        if (!Exchange(port, latches[i][slot])) good = false;
      }
    });
  }
  for (std::thread& thread : threads) thread.join();
  if (!good) return 1;
  std::vector<std::int64_t> hulls;
  for (std::size_t slot = 0; slot < slots; ++slot) {
    Latch hull = latches[0][slot];
    for (const auto& of_port : latches) {
      hull.earliest = std::min(hull.earliest, of_port[slot].earliest);
      hull.latest = std::max(hull.latest, of_port[slot].latest);
    }
    hulls.push_back(hull.latest - hull.earliest);
  }
  std::printf("{");
  axlecast::bench::PrintDistribution("hull", std::move(hulls));
  std::printf("}\n");
  return 0;
}
