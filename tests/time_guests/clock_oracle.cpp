// Runs on the host: bounds what a guest's time stamp counter is ahead of the host's. In each handshake the guest reads its counter between
// two readings of the host's, whatever the scheduling does. The bounds of all handshakes are intersected.
//
//   clock_oracle FILE SECONDS   the shared page; ends after 20,000 handshakes or this time
//
// Prints a line "LOWEST HIGHEST", in ticks and including kCounterError, and on standard error what it rests on. Fails without 100 handshakes: no agent answers.
#include <algorithm>
#include <cerrno>
#include <cinttypes>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <ctime>

#include "tests/time_guests/clock_page.h"

namespace axlecast {
namespace {

constexpr std::int64_t kHandshakes = 20'000;
constexpr std::int64_t kFewest = 100;

std::int64_t Now() {
  timespec now{};
  clock_gettime(CLOCK_MONOTONIC, &now);
  return now.tv_sec * 1'000'000'000 + now.tv_nsec;
}

int Run(ClockPage& page, std::int64_t duration) {
  const std::int64_t end = Now() + duration;
  CpuTicks lowest = INT64_MIN;
  CpuTicks highest = INT64_MAX;
  CpuTicks shortest = INT64_MAX;
  std::int64_t done = 0;
  page.asking.store(1);
  while (done < kHandshakes && Now() < end) {
    const std::int64_t question = page.question.load(std::memory_order_relaxed) + 1;
    const CpuTicks asked = ReadCpuTicks();
    page.question.store(question, std::memory_order_release);
    while (page.answer.load(std::memory_order_acquire) != question && Now() < end) {
    }
    const CpuTicks answered = ReadCpuTicks();
    if (page.answer.load(std::memory_order_acquire) != question) break;
    const CpuTicks guest = page.answer_ticks.load(std::memory_order_relaxed);
    lowest = std::max(lowest, guest - answered);
    highest = std::min(highest, guest - asked);
    shortest = std::min(shortest, answered - asked);
    ++done;
  }
  page.asking.store(0);
  if (done < kFewest) {
    std::fprintf(stderr, "%" PRId64 " handshakes: does clock_agent run in the guest?\n", done);
    return 1;
  }
  lowest -= kCounterError;
  highest += kCounterError;
  std::printf("%" PRId64 " %" PRId64 "\n", lowest, highest);
  std::fprintf(stderr, "%" PRId64 " handshakes, the shortest %" PRId64 " ticks: known to %" PRId64 " ticks\n", done,
               shortest, highest - lowest);
  return 0;
}

}  // namespace
}  // namespace axlecast

int main(int argc, char** argv) {
  const double seconds = argc == 3 ? std::atof(argv[2]) : 0;
  if (seconds <= 0) {
    std::fprintf(stderr, "usage: clock_oracle FILE SECONDS\n");
    return 2;
  }
  axlecast::ClockPage* page = axlecast::MapClockPage(argv[1]);
  if (page == nullptr) {
    std::fprintf(stderr, "cannot map %s: %s\n", argv[1], std::strerror(errno));
    return 1;
  }
  return axlecast::Run(*page, static_cast<std::int64_t>(seconds * 1e9));
}
