#pragma once

#include <fcntl.h>
#include <sys/mman.h>
#include <unistd.h>
#include <x86intrin.h>

#include <atomic>
#include <cstddef>
#include <cstdint>

namespace axlecast {

// A count of the processor's time stamp counter. Under QEMU without acceleration, that of a guest is that of its host minus a constant.
using CpuTicks = std::int64_t;

// Two readings of the counter, on two cores of a host, may be in the wrong order by this. On a host that is itself a virtual machine, the
// counters of its cores were seen to differ by up to some 150 ticks. They count in steps of up to 26.
inline constexpr CpuTicks kCounterError = 500;

inline CpuTicks ReadCpuTicks() {
  _mm_lfence();  // what comes before is done
  const auto ticks = static_cast<CpuTicks>(__rdtsc());
  _mm_lfence();
  return ticks;
}

// The clocks of a host, read between two readings of its counter.
struct ClockReading {
  CpuTicks before = 0;
  std::int64_t mono = 0;  // ns, CLOCK_MONOTONIC
  std::int64_t raw = 0;   // ns, CLOCK_MONOTONIC_RAW
  std::int64_t utc = 0;   // ns, CLOCK_REALTIME
  CpuTicks after = 0;
};

// Memory that a guest and its host share: a file of the host, and a PCI device in the guest. The agent in the guest appends readings. While
// the host asks, it also answers with its counter.
struct ClockPage {
  static constexpr std::size_t kBytes = std::size_t{16} << 20U;
  static constexpr std::int64_t kReadings = (kBytes - 4'096) / sizeof(ClockReading);

  std::atomic<std::int64_t> asking;    // by the host: 1 while questions come
  std::atomic<std::int64_t> question;  // by the host: its number
  std::atomic<std::int64_t> answer;    // by the guest: the number of the question, after answer_ticks
  std::atomic<CpuTicks> answer_ticks;  // by the guest: its counter, read after the question and before the answer
  std::atomic<std::int64_t> count;     // by the guest: readings that are complete
  alignas(4'096) ClockReading readings[kReadings];
};
static_assert(sizeof(ClockPage) <= ClockPage::kBytes);
static_assert(std::atomic<std::int64_t>::is_always_lock_free);

// Maps the page; null if that fails: see errno. It remains mapped until the process ends.
inline ClockPage* MapClockPage(const char* path) {
  const int file = open(path, O_RDWR | O_CLOEXEC);
  if (file < 0) return nullptr;
  void* memory = mmap(nullptr, ClockPage::kBytes, PROT_READ | PROT_WRITE, MAP_SHARED, file, 0);
  close(file);
  return memory == MAP_FAILED ? nullptr : static_cast<ClockPage*>(memory);
}

}  // namespace axlecast
