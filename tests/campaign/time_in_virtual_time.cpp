// The time base of a machine in virtual time: a root and two hosts, whose clocks drift and are slewed, on a network with delays that
// differ by direction, while links are cut, services and hosts start again, and hosts are suspended. Every published interval, and every
// instant that a consumer is given, is compared with the truth.
//
//   time_in_virtual_time COUNT   until COUNT intervals were published
#include <axlecast/time_base.h>
#include <algorithm>
#include <array>
#include <cinttypes>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <deque>
#include <random>

#include "core/time/time_keeper.h"

namespace axlecast {
namespace {

using Random = std::mt19937_64;

double Uniform(Random& random, double least, double most) {
  return std::uniform_real_distribution<double>(least, most)(random);
}
bool Happens(Random& random, double probability) { return Uniform(random, 0, 1) < probability; }

// A clock in stretches of constant rate. Time is that of the test, in ns from 0.
class DriftingClock {
 public:
  DriftingClock(MonoNs start, double most_ppm, Random& random) : most_ppm_(most_ppm), random_(random) {
    stretches_.push_back({0, start, Uniform(random, -most_ppm, most_ppm)});
  }

  MonoNs At(MonoNs time) {
    while (time >= stretches_.back().begin + kStretch) Continue();
    const auto found = std::find_if(stretches_.rbegin(), stretches_.rend(),
                                    [&](const Stretch& each) { return each.begin <= time; });
    return Value(*found, time);
  }
  // The clock stops for `time` from now on.
  void Stop(MonoNs now, MonoNs time) {
    const MonoNs value = At(now);
    while (stretches_.back().begin >= now) stretches_.pop_back();
    stretches_.push_back({now, value, kStopped});
    stretches_.push_back({now + time, value, Uniform(random_, -most_ppm_, most_ppm_)});
  }

 private:
  static constexpr MonoNs kStretch = kSecond;
  static constexpr double kStopped = -1e6;  // ppm
  struct Stretch {
    MonoNs begin = 0;
    MonoNs value = 0;
    double ppm = 0;
  };

  static MonoNs Value(const Stretch& stretch, MonoNs time) {
    const MonoNs passed = time - stretch.begin;
    return stretch.value + passed + static_cast<MonoNs>(static_cast<double>(passed) * stretch.ppm * 1e-6);
  }
  void Continue() {
    const MonoNs begin = stretches_.back().begin + kStretch;
    const MonoNs value = Value(stretches_.back(), begin);
    // Wanders, and now and then jumps to another rate at once.
    const double near = std::clamp(stretches_.back().ppm + Uniform(random_, -2, 2), -most_ppm_, most_ppm_);
    stretches_.push_back({begin, value, Happens(random_, 0.05) ? Uniform(random_, -most_ppm_, most_ppm_) : near});
    if (stretches_.size() > 40) stretches_.pop_front();
  }

  double most_ppm_;
  Random& random_;
  std::deque<Stretch> stretches_;
};

constexpr double kRate = 49.5;  // ppm of CLOCK_MONOTONIC_RAW: of two of them, less than 100
constexpr double kSlew = 990;   // ppm of CLOCK_MONOTONIC against CLOCK_MONOTONIC_RAW

// A host: its clocks, and its time service.
class Host {
 public:
  Host(std::int64_t id, bool root, Random& random)
      : clock_id(id),
        root_(root),
        random_(random),
        raw_(MonoNs(id) * 1'000 * kSecond, kRate, random),
        slew_(0, kSlew, random),
        keeper_({}, root ? BaseId() : 0) {}

  MonoNs Raw(MonoNs time) { return raw_.At(time); }
  // Follows CLOCK_MONOTONIC_RAW, at another rate.
  MonoNs Mono(MonoNs time) { return slew_.At(raw_.At(time)) + 5 * kSecond; }
  MonoNs Boot(MonoNs time) { return Mono(time) + suspended_; }

  time_quality_t Publish(MonoNs time) {
    const MonoNs width = Happens(random_, 0.01) ? 4 * kMillisecond : 60;
    const MonoNs read = time - width / 2;
    keeper_.OnClocks({Raw(time - width), Mono(read), Boot(read), Raw(time)});
    time_quality_t message{};
    message.clock_id = clock_id;
    message.boot_id = service_;
    keeper_.Describe(message);
    published_at = read;
    return message;
  }
  void OnExchange(const TimeExchange& exchange, std::int64_t base_id) {
    static_cast<void>(keeper_.OnExchange(exchange, base_id));
  }

  void Suspend(MonoNs now, MonoNs time) {
    raw_.Stop(now, time);
    suspended_ += time;
    asleep_from = now;
    asleep_until = now + time;
  }
  void RestartService() {
    ++service_;
    keeper_ = TimeKeeper({}, root_ ? BaseId() : 0);
  }
  [[nodiscard]] std::int64_t BaseId() const { return clock_id; }

  std::int64_t clock_id;
  MonoNs published_at = 0;
  MonoNs asleep_from = 0;
  MonoNs asleep_until = 0;
  MonoNs cut_from = 0;
  MonoNs cut_until = 0;

 private:
  bool root_;
  Random& random_;
  DriftingClock raw_;
  DriftingClock slew_;
  MonoNs suspended_ = 0;
  std::int64_t service_ = 1;
  TimeKeeper keeper_;
};

struct Tally {
  std::int64_t published = 0;
  std::int64_t claims = 0;
  std::int64_t wrong_claims = 0;
  std::int64_t asked = 0;
  std::int64_t answered = 0;
  std::int64_t wrong_answers = 0;
  std::int64_t late_withdrawals = 0;
  std::int64_t cuts = 0;
  std::int64_t suspensions = 0;
  std::int64_t restarts = 0;
  MonoNs widest = 0;
};

class World {
 public:
  explicit World(std::uint64_t seed) : random_(seed) {}

  Tally Run(std::int64_t count) {
    for (MonoNs now = 10 * kSecond; tally_.published < count; now += 100 * kMillisecond) {
      Disturb(now);
      for (Host& host : hosts_) {
        if (now < host.asleep_until) continue;
        if (&host != &Root()) Exchange(host, now);
        Publish(host, now + 20 * kMillisecond);
      }
      Consume(now + 30 * kMillisecond);
    }
    return tally_;
  }

 private:
  Host& Root() { return hosts_[0]; }

  void Disturb(MonoNs now) {
    for (Host& host : hosts_) {
      if (now < host.asleep_until + 10 * kSecond) continue;
      if (&host != &Root() && Happens(random_, 0.001)) {
        host.cut_from = now;
        host.cut_until = now + static_cast<MonoNs>(Uniform(random_, 0.2, 10) * 1e9);
        ++tally_.cuts;
      }
      if (&host != &Root() && Happens(random_, 0.0005)) {
        host.Suspend(now, static_cast<MonoNs>(Uniform(random_, 2, 20) * 1e9));
        ++tally_.suspensions;
      }
      if (Happens(random_, 0.0005)) {
        host.RestartService();
        ++tally_.restarts;
      }
    }
    if (Happens(random_, 0.002)) asymmetry_ = Uniform(random_, -2e6, 2e6);
  }

  MonoNs Delay(double more) {
    const double queue = std::exponential_distribution<double>(1 / 200e3)(random_);
    return static_cast<MonoNs>(50e3 + queue + std::max(0.0, more) + (Happens(random_, 0.01) ? 10e6 : 0));
  }

  void Exchange(Host& host, MonoNs now) {
    if (now < host.cut_until || Happens(random_, 0.05)) return;
    const MonoNs asked = now + Delay(asymmetry_);
    const MonoNs answered = asked + static_cast<MonoNs>(Uniform(random_, 0, 50e3));
    const MonoNs received = answered + Delay(-asymmetry_);
    if (received > now + 20 * kMillisecond) return;  // too late to be used
    host.OnExchange({host.Raw(now), host.Raw(received), Root().Raw(asked), Root().Raw(answered)}, Root().BaseId());
  }

  void Publish(Host& host, MonoNs now) {
    const time_quality_t message = host.Publish(now);
    ++tally_.published;
    consumer_.OnTime(message, now);
    if (message.half_width_ns < 0) return;
    ++tally_.claims;
    tally_.widest = std::max(tally_.widest, message.half_width_ns);
    const MonoNs truth = Root().Raw(host.published_at);
    if (std::abs(truth - message.base_ns) > message.half_width_ns) ++tally_.wrong_claims;
    if (now < host.cut_until && now - host.cut_from > 2 * kSecond) ++tally_.late_withdrawals;
  }

  // Readings of the last second, of each host, as a consumer converts them.
  void Consume(MonoNs now) {
    for (Host& of : hosts_) {
      const MonoNs time = now - static_cast<MonoNs>(Uniform(random_, 0, 1.5e9));
      if (time >= of.asleep_from && time <= of.asleep_until) continue;
      const MonoNs mono = of.Mono(time);
      Judge(consumer_.OnBase(of.clock_id, mono, now), Root().Raw(time));
      for (Host& to : hosts_) {
        if (&to != &of && now >= to.asleep_until + 3 * kSecond)
          Judge(consumer_.OnClock(to.clock_id, of.clock_id, mono, now), to.Mono(time));
      }
    }
  }
  void Judge(const TimeBase::Instant& instant, MonoNs truth) {
    ++tally_.asked;
    if (!instant) return;
    ++tally_.answered;
    if (std::abs(truth - instant.ns) > instant.half_width_ns) ++tally_.wrong_answers;
  }

  Random random_;
  std::array<Host, 3> hosts_ = {Host(1, true, random_), Host(2, false, random_), Host(3, false, random_)};
  double asymmetry_ = 0;
  TimeBase consumer_;
  Tally tally_;
};

int Report(const Tally& tally) {
  std::printf("%" PRId64 " intervals published, %" PRId64 " with a claim, the widest +-%.3f ms; %" PRId64
              " miss the truth\n",
              tally.published, tally.claims, static_cast<double>(tally.widest) * 1e-6, tally.wrong_claims);
  std::printf("%" PRId64 " instants asked for, %" PRId64 " answered; %" PRId64 " miss the truth\n", tally.asked,
              tally.answered, tally.wrong_answers);
  std::printf("%" PRId64 " cuts, %" PRId64 " suspensions, %" PRId64 " restarts; %" PRId64
              " claims later than 2 s after a cut\n",
              tally.cuts, tally.suspensions, tally.restarts, tally.late_withdrawals);
  const bool good = tally.wrong_claims == 0 && tally.wrong_answers == 0 && tally.late_withdrawals == 0;
  // A run in which nothing was claimed, or nothing went wrong, shows nothing.
  const bool shows = tally.claims > tally.published / 2 && tally.answered > tally.asked / 2 && tally.cuts > 0 &&
                     tally.suspensions > 0;
  if (!shows) std::printf("too little was claimed or disturbed to show anything\n");
  return good && shows ? 0 : 1;
}

}  // namespace
}  // namespace axlecast

int main(int argc, char** argv) {
  const std::int64_t count = argc > 1 ? std::atoll(argv[1]) : 0;
  if (count <= 0) {
    std::fprintf(stderr, "usage: time_in_virtual_time COUNT\n");
    return 2;
  }
  return axlecast::Report(axlecast::World(1).Run(count));
}
