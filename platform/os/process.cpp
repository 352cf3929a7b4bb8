#include "platform/os/process.h"

#include <poll.h>
#include <sched.h>
#include <sys/mman.h>
#include <sys/prctl.h>
#include <sys/random.h>
#include <sys/resource.h>
#include <sys/syscall.h>
#include <systemd/sd-daemon.h>
#include <unistd.h>

#if defined(__x86_64__)
#include <cpuid.h>
#endif

#include <algorithm>
#include <atomic>
#include <cerrno>
#include <csignal>
#include <cstdlib>
#include <cstring>
#include <fstream>

#include "core/base/text.h"

namespace axlecast {
namespace {

std::atomic<const WakeEvent*> stop_event{nullptr};
std::atomic<int> stop_count{0};
static_assert(std::atomic<int>::is_always_lock_free && std::atomic<const WakeEvent*>::is_always_lock_free);

void OnStopSignal(int) {
  const int saved = errno;
  ++stop_count;
  if (const WakeEvent* event = stop_event) event->Set();
  errno = saved;
}

void SetAction(void (*handler)(int)) {
  struct sigaction action {};
  action.sa_handler = handler;
  action.sa_flags = SA_RESTART;
  sigaction(SIGINT, &action, nullptr);
  sigaction(SIGTERM, &action, nullptr);
}

std::string Reason() { return std::strerror(errno); }

// CLOCK_MONOTONIC begins at the boot of the kernel, and a time namespace shifts it (time_namespaces(7)). A unit with ProcSubset=pid
// sees no /proc/sys: its AXLECAST_BOOT_ID is systemd's %b. Returns no text if the boot is not known.
std::string ClockText() {
  std::string boot;
  std::getline(std::ifstream("/proc/sys/kernel/random/boot_id"), boot);
  const char* given = std::getenv("AXLECAST_BOOT_ID");
  if (boot.empty() && given != nullptr) boot = given;
  std::erase(boot, '-');
  if (boot.empty()) return "";
  std::array<char, 64> space{};
  const ssize_t size = readlink("/proc/self/ns/time", space.data(), space.size());
  return boot + std::string(space.data(), static_cast<std::size_t>(std::max<ssize_t>(size, 0)));
}

}  // namespace

std::int64_t RandomBootId() {
  std::uint64_t id = 0;
  while ((id & INT64_MAX) == 0) {
    if (getrandom(&id, sizeof id, 0) != static_cast<ssize_t>(sizeof id)) id = 0;
  }
  return static_cast<std::int64_t>(id & INT64_MAX);
}

Origin NewOrigin(std::string_view machine) {
  static const std::string kClock = ClockText();
  return {.boot_id = RandomBootId(),
          .machine_id = machine.empty() ? 0 : NameHash(machine),
          .clock_id = kClock.empty() ? 0 : NameHash(kClock),
          .machine = CappedText(machine, kNameBytes)};
}

bool IsVirtualMachine() {
#if defined(__x86_64__)
  unsigned eax = 0;
  unsigned ebx = 0;
  unsigned ecx = 0;
  unsigned edx = 0;
  constexpr unsigned kHypervisor = 1U << 31U;  // reserved by the makers of processors for hypervisors
  return __get_cpuid(1, &eax, &ebx, &ecx, &edx) != 0 && (ecx & kHypervisor) != 0;
#else
  return false;
#endif
}

std::array<std::uint8_t, 16> RandomId() {
  std::array<std::uint8_t, 16> id{};
  while (getrandom(id.data(), id.size(), 0) != static_cast<ssize_t>(id.size())) {
  }
  return id;
}

std::vector<std::string> ApplyRealtime(int priority, int cpu, bool lock_memory) {
  std::vector<std::string> warnings;
  if (prctl(PR_SET_TIMERSLACK, 1UL, 0UL, 0UL, 0UL) != 0) warnings.push_back("timer slack: " + Reason());
  if (cpu >= 0) {
    cpu_set_t set;
    CPU_ZERO(&set);
    CPU_SET(static_cast<std::size_t>(cpu), &set);
    if (sched_setaffinity(0, sizeof set, &set) != 0) {
      warnings.push_back("realtime.cpu " + std::to_string(cpu) + ": " + Reason() +
                         "; lscpu lists this machine's processors");
    }
  }
  if (priority > 0) {
    sched_param parameters{};
    parameters.sched_priority = priority;
    if (sched_setscheduler(0, SCHED_FIFO | SCHED_RESET_ON_FORK, &parameters) != 0) {
      warnings.push_back("realtime.priority " + std::to_string(priority) + ": " + Reason() +
                         "; allow it with LimitRTPRIO=" + std::to_string(priority) +
                         " in the systemd unit, or ulimit -r");
    }
  }
  if (lock_memory && mlockall(MCL_CURRENT | MCL_FUTURE) != 0) {
    warnings.push_back("realtime.lock_memory: " + Reason() +
                       "; allow it with LimitMEMLOCK=infinity in the systemd unit, or ulimit -l unlimited");
  }
  return warnings;
}

void LowerPriority() {
  constexpr int kLowest = 19;
  constexpr int kOfThread = 1;         // IOPRIO_WHO_PROCESS, ioprio_set(2): the C library has no name for these
  constexpr int kIdleClass = 3 << 13;  // IOPRIO_PRIO_VALUE(IOPRIO_CLASS_IDLE, 0)
  static_cast<void>(setpriority(PRIO_PROCESS, static_cast<id_t>(gettid()), kLowest));
  static_cast<void>(syscall(SYS_ioprio_set, kOfThread, 0, kIdleClass));
}

Result<> ForbidCoreDumps() {
  const rlimit none{0, 0};
  // One would be sufficient, except for a core_pattern that pipes into a program: a pipe ignores the limit.
  if (prctl(PR_SET_DUMPABLE, 0UL, 0UL, 0UL, 0UL) != 0 || setrlimit(RLIMIT_CORE, &none) != 0) {
    return Failure("cannot forbid core dumps: " + Reason() + "; a core dump of this process would show passwords");
  }
  return {};
}

#if defined(__has_feature)
#define AXLECAST_HAS_FEATURE(name) __has_feature(name)
#else
#define AXLECAST_HAS_FEATURE(name) 0
#endif
Result<> LimitMemory(std::size_t bytes) {
#if defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__) || AXLECAST_HAS_FEATURE(address_sanitizer) || \
    AXLECAST_HAS_FEATURE(thread_sanitizer)
  static_cast<void>(bytes);
  return {};
#else
  const rlimit limit{bytes, bytes};
  if (setrlimit(RLIMIT_DATA, &limit) != 0) return Failure("cannot limit the memory: " + Reason());
  return {};
#endif
}

pid_t ForkWithoutHandlers() {
  sigset_t all;
  sigset_t before;
  sigfillset(&all);
  pthread_sigmask(SIG_SETMASK, &all, &before);
  const pid_t pid = fork();
  const int error = errno;
  if (pid == 0) SetAction(SIG_DFL);
  pthread_sigmask(SIG_SETMASK, &before, nullptr);
  errno = error;
  return pid;
}

StopSignal::StopSignal() {
  stop_count = 0;
  stop_event = &event_;
  SetAction(&OnStopSignal);
}

StopSignal::~StopSignal() {
  SetAction(SIG_DFL);
  stop_event = nullptr;
}

int StopSignal::Count() const { return stop_count; }

bool StopSignal::Wait(int timeout_ms) const {
  pollfd readable{event_.FileDescriptor(), POLLIN, 0};
  while (!Requested()) {
    const int ready = poll(&readable, 1, timeout_ms);
    if (ready == 0) break;
    if (ready < 0 && errno != EINTR) break;
  }
  return Requested();
}

Supervision::Supervision() {
  std::uint64_t watchdog_us = 0;
  if (sd_watchdog_enabled(0, &watchdog_us) > 0) {
    interval_ = static_cast<MonoNs>(watchdog_us) * kMicrosecond / 3;
    next_ping_ = 0;
  }
}

// If systemd does not accept a message, the message is lost, and the watchdog acts.
void Supervision::Ready() { sd_notify(0, "READY=1"); }

void Supervision::Status(const std::string& text) { sd_notify(0, ("STATUS=" + text).c_str()); }

void Supervision::Stopping() { sd_notify(0, "STOPPING=1"); }

void Supervision::Ping(MonoNs now) {
  sd_notify(0, "WATCHDOG=1");
  next_ping_ = now + interval_;
}

}  // namespace axlecast
