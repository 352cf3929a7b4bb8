#pragma once

#include <cstdint>
#include <deque>
#include <string>
#include <utility>

#include "core/base/time.h"
#include "core/messages/origin.h"
#include "tests/simulation/random.h"
#include "tests/simulation/schedule.h"

namespace axlecast::simulation {

// The clocks of a host: CLOCK_MONOTONIC_RAW at the rate of its quartz, CLOCK_MONOTONIC that a daemon slews, and UNIX time that may be
// stepped.
class HostClock final : public Clock {
 public:
  // `start`: CLOCK_MONOTONIC at the begin of the simulation. `ahead`: of its UNIX time, in us.
  HostClock(const Schedule& schedule, MonoNs start, double raw_ppm, std::int64_t ahead)
      : schedule_(schedule),
        raw_ppm_(raw_ppm),
        raw_start_(start + 7 * kSecond),
        utc_us_(kUtcStart + ahead - start / kMicrosecond) {
    stretches_.push_back({0, start, raw_ppm});
  }

  [[nodiscard]] MonoNs Now() const override { return MonoAt(schedule_.now()); }
  [[nodiscard]] std::int64_t UtcMicroseconds() const override { return utc_us_ + Now() / kMicrosecond; }
  // `time`: of the schedule; not before the last 64 changes of the rate.
  [[nodiscard]] MonoNs MonoAt(MonoNs time) const {
    const Stretch& stretch = StretchOf([time](const Stretch& each) { return each.begin <= time; });
    return stretch.value + Elapsed(time - stretch.begin, stretch.ppm);
  }
  // Returns the time of the schedule at which CLOCK_MONOTONIC has this value, +- 2 ns.
  [[nodiscard]] MonoNs TimeOf(MonoNs mono) const {
    const Stretch& stretch = StretchOf([mono](const Stretch& each) { return each.value <= mono; });
    return stretch.begin + Elapsed(mono - stretch.value, -stretch.ppm / (1 + stretch.ppm * 1e-6));
  }
  [[nodiscard]] MonoNs RawAt(MonoNs time) const { return raw_start_ + Elapsed(time, raw_ppm_); }

  // From now on, CLOCK_MONOTONIC runs so much faster than CLOCK_MONOTONIC_RAW.
  void Slew(double ppm) {
    stretches_.push_back({schedule_.now(), Now(), raw_ppm_ + ppm});
    if (stretches_.size() > 64) stretches_.pop_front();
  }
  void StepUtc(std::int64_t us) { utc_us_ += us; }

 private:
  static constexpr std::int64_t kUtcStart = 1'800'000'000'000'000;
  struct Stretch {
    MonoNs begin;
    MonoNs value;
    double ppm;
  };

  [[nodiscard]] static MonoNs Elapsed(MonoNs time, double ppm) {
    return time + static_cast<MonoNs>(static_cast<double>(time) * ppm * 1e-6);
  }
  template <typename Holds>
  [[nodiscard]] const Stretch& StretchOf(const Holds& holds) const {
    for (auto each = stretches_.rbegin(); each != stretches_.rend(); ++each) {
      if (holds(*each)) return *each;
    }
    return stretches_.front();
  }

  const Schedule& schedule_;
  const double raw_ppm_;
  const MonoNs raw_start_;
  std::int64_t utc_us_;
  std::deque<Stretch> stretches_;
};

// One host of the machine.
class Host {
 public:
  Host(std::string host_name, Schedule& schedule, std::uint64_t seed, MonoNs start, double raw_ppm,
       std::int64_t ahead)
      : name(std::move(host_name)), clock(schedule, start, raw_ppm, ahead), random(seed, NamePart()) {}

  // How much later a thread runs than it should.
  [[nodiscard]] MonoNs Late() {
    const MonoNs usual = kMicrosecond + random.Delay(20 * kMicrosecond);
    return starved > 0 && random.Happens(0.05) ? usual + random.Time(0, starved) : usual;
  }
  [[nodiscard]] std::int64_t clock_id() const { return NameHash("clock of " + name); }
  // Returns the identity of a process that starts now.
  [[nodiscard]] Origin NewOrigin(const std::string& machine) {
    return {.boot_id = static_cast<std::int64_t>(random.Next() >> 1U) | 1,
            .machine_id = NameHash(machine),
            .clock_id = clock_id(),
            .machine = machine};
  }

  const std::string name;
  HostClock clock;
  Random random;
  MonoNs starved = 0;  // threads run up to so much later than they should

 private:
  [[nodiscard]] std::uint64_t NamePart() const { return static_cast<std::uint64_t>(NameHash(name)); }
};

}  // namespace axlecast::simulation
