// Runs in a guest, and once on its host: appends readings of the clocks to the shared page, 100 a second, until it is killed. While the
// host asks (clock_oracle.cpp), it spins and answers each question with the time stamp counter.
//
//   clock_agent FILE   the shared page: `resource2` of the PCI device, or a file of ClockPage::kBytes
//
// It reads the clocks itself and shares no code with the programs under test.
#include <cerrno>
#include <cstdio>
#include <cstring>
#include <ctime>

#include "tests/time_guests/clock_page.h"

namespace axlecast {
namespace {

constexpr std::int64_t kPeriod = 10'000'000;  // ns
constexpr int kAttempts = 5;

std::int64_t Read(clockid_t id) {
  timespec now{};
  clock_gettime(id, &now);
  return now.tv_sec * 1'000'000'000 + now.tv_nsec;
}

// The narrowest of a few attempts: one that the scheduler interrupts is wide.
ClockReading ReadClocks() {
  ClockReading best;
  for (int i = 0; i < kAttempts; ++i) {
    ClockReading reading;
    reading.before = ReadCpuTicks();
    reading.mono = Read(CLOCK_MONOTONIC);
    reading.raw = Read(CLOCK_MONOTONIC_RAW);
    reading.utc = Read(CLOCK_REALTIME);
    reading.after = ReadCpuTicks();
    if (i == 0 || reading.after - reading.before < best.after - best.before) best = reading;
  }
  return best;
}

void Append(ClockPage& page) {
  const std::int64_t count = page.count.load(std::memory_order_relaxed);
  if (count == ClockPage::kReadings) return;
  page.readings[count] = ReadClocks();
  page.count.store(count + 1, std::memory_order_release);
}

void Answer(ClockPage& page) {
  const std::int64_t question = page.question.load(std::memory_order_acquire);
  if (question == page.answer.load(std::memory_order_relaxed)) return;
  page.answer_ticks.store(ReadCpuTicks(), std::memory_order_relaxed);
  page.answer.store(question, std::memory_order_release);
}

[[noreturn]] void Serve(ClockPage& page) {
  std::int64_t next = Read(CLOCK_MONOTONIC);
  while (true) {
    Append(page);
    next = Read(CLOCK_MONOTONIC) + kPeriod;
    while (page.asking.load(std::memory_order_relaxed) != 0 && Read(CLOCK_MONOTONIC) < next) {
      for (int i = 0; i < 100; ++i) Answer(page);
    }
    const std::int64_t left = next - Read(CLOCK_MONOTONIC);
    const timespec pause = {0, left > 0 ? left : 0};
    nanosleep(&pause, nullptr);
  }
}

}  // namespace
}  // namespace axlecast

int main(int argc, char** argv) {
  if (argc != 2) {
    std::fprintf(stderr, "usage: clock_agent FILE\n");
    return 2;
  }
  axlecast::ClockPage* page = axlecast::MapClockPage(argv[1]);
  if (page == nullptr) {
    std::fprintf(stderr, "cannot map %s: %s\n", argv[1], std::strerror(errno));
    return 1;
  }
  axlecast::Serve(*page);
}
