#include "tests/time_guests/judge.h"

#include <axlecast/time_base.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <random>

namespace axlecast {
namespace {

using GuestClock = ClockLog::Clock;

class Judge {
 public:
  Judge(const GuestRun& run, const JudgeOptions& options) : run_(run), options_(options) {}

  std::vector<PhaseFigures> Run() {
    for (const TestEvent& event : run_.events) {
      if (event.kind != TestEvent::Kind::kPhase || Find(event.text) != phases_.end()) continue;
      phases_.push_back({});
      phases_.back().name = event.text;
    }
    if (phases_.empty()) return phases_;
    for (const Guest& guest : run_.guests) {
      for (const Guest::Message& message : guest.messages) {
        if (message.time.host != guest.host) continue;
        OnClaim(guest, message.time);
        OnUtc(guest, message.time);
      }
      Consume(guest);
      for (const Guest::UtcClaim& claim : guest.utc_claims) OnUtcClaim(guest, claim);
    }
    return phases_;
  }

 private:
  // CLOCK_MONOTONIC of the host that runs the guests.
  [[nodiscard]] std::optional<MonoNs> HostTime(const Bounds& host_ticks) const {
    const std::optional<Bounds> time = run_.host.At(GuestClock::kMono, host_ticks);
    if (!time) return std::nullopt;
    return time->lowest;
  }
  std::vector<PhaseFigures>::iterator Find(const std::string& name) {
    return std::find_if(phases_.begin(), phases_.end(),
                        [&](const PhaseFigures& phase) { return phase.name == name; });
  }
  PhaseFigures& PhaseAt(MonoNs time) { return *Find(run_.PhaseAt(time)); }
  // Returns the newest of two kinds of events if it is of the first kind.
  [[nodiscard]] std::optional<MonoNs> Since(TestEvent::Kind begin, TestEvent::Kind end, MonoNs time) const {
    std::optional<MonoNs> since;
    for (const TestEvent& event : run_.events) {
      if (event.at > time) continue;
      if (event.kind == begin) since = event.at;
      if (event.kind == end) since.reset();
    }
    return since;
  }
  [[nodiscard]] bool IsBeyond(MonoNs time) const {
    return Since(TestEvent::Kind::kBeyond, TestEvent::Kind::kWithin, time).has_value();
  }

  void OnClaim(const Guest& guest, const time_quality_t& claim) {
    if (claim.half_width_ns < 0) return;
    const std::optional<Bounds> ticks = guest.clocks.When(GuestClock::kMono, claim.mono_ns);
    if (!ticks) return;  // before the first reading or after the last one
    const Bounds host_ticks = GuestRun::OnHost(guest, *ticks);
    const std::optional<MonoNs> time = HostTime(host_ticks);
    if (!time) return;
    PhaseFigures& phase = PhaseAt(*time);
    const bool root = claim.base_id == guest.own_base_id;
    // The two counters of the root are the same one, which is known better than by way of the host.
    const std::optional<Bounds> truth =
        root ? guest.clocks.At(GuestClock::kRaw, *ticks) : run_.BaseAt(claim.base_id, host_ticks);
    const Verdict verdict = JudgeInterval(truth, claim.base_ns, claim.half_width_ns);
    if (root) {
      phase.own.Count(verdict);
      return;
    }
    (IsBeyond(*time) ? phase.beyond : phase.claims).Count(verdict);
    CheckWithdrawal(guest, *time, phase);
    if (!truth) return;
    const std::int64_t middle = truth->lowest + (truth->highest - truth->lowest) / 2;
    phase.half_widths.push_back(claim.half_width_ns);
    phase.from_middle.push_back(std::abs(middle - claim.base_ns));
    phase.oracle_error = std::max(phase.oracle_error, truth->highest - truth->lowest);
  }

  // UNIX time of the root, which is the server of chronyd in the guest.
  void OnUtcClaim(const Guest& guest, const Guest::UtcClaim& claim) {
    const std::optional<Bounds> ticks = guest.clocks.When(GuestClock::kMono, claim.mono);
    if (!ticks) return;
    const Bounds host_ticks = GuestRun::OnHost(guest, *ticks);
    const std::optional<MonoNs> time = HostTime(host_ticks);
    const std::optional<Bounds> own = guest.clocks.At(GuestClock::kUtc, *ticks);
    if (!time || !own) return;
    PhaseFigures& phase = PhaseAt(*time);
    for (const Guest& root : run_.guests) {
      const auto server = root.clocks.At(GuestClock::kUtc, GuestRun::OnGuest(root, host_ticks));
      if (root.own_base_id == 0 || !server) continue;
      const Bounds error = own->Minus(*server);
      phase.utc.Count(JudgeInterval(error, 0, claim.half_width));
      phase.utc_half_widths.push_back(claim.half_width);
      phase.utc_errors.push_back(std::max(std::abs(error.lowest), std::abs(error.highest)));
    }
  }
  // The claim of UNIX time that a message states beside that of the base.
  void OnUtc(const Guest& guest, const time_quality_t& message) {
    if (message.utc_grade == time_quality_t::GRADE_NONE || message.utc_half_width_ns < 0) return;
    const std::optional<Bounds> ticks = guest.clocks.When(GuestClock::kMono, message.mono_ns);
    if (!ticks) return;
    const Bounds host_ticks = GuestRun::OnHost(guest, *ticks);
    const std::optional<MonoNs> time = HostTime(host_ticks);
    if (!time) return;
    for (const Guest& root : run_.guests) {
      const auto server = root.clocks.At(GuestClock::kUtc, GuestRun::OnGuest(root, host_ticks));
      if (root.own_base_id == 0 || !server) continue;
      PhaseAt(*time).utc_published.Count(JudgeInterval(server, message.utc_ns, message.utc_half_width_ns));
    }
  }

  // A guest that the host of the test starves notices a cause later.
  void CheckWithdrawal(const Guest& guest, MonoNs time, PhaseFigures& phase) {
    const std::optional<MonoNs> cause = Since(TestEvent::Kind::kWithdraw, TestEvent::Kind::kResume, time);
    if (!cause) return;
    phase.last = std::max(phase.last, time - *cause);
    if (time <= *cause + kWithdrawal) return;
    const auto from = run_.host.When(GuestClock::kMono, *cause - kSecond);
    const auto until = run_.host.When(GuestClock::kMono, time);
    if (!from || !until) return;
    const MonoNs gap =
        guest.clocks.LongestGap(GuestRun::OnGuest(guest, *from).lowest, GuestRun::OnGuest(guest, *until).highest);
    phase.starved = std::max(phase.starved, gap);
    if (time > *cause + kWithdrawal + gap) ++phase.late;
  }

  // An instant at which a guest read its CLOCK_MONOTONIC.
  struct Reading {
    MonoNs mono = 0;
    Bounds host_ticks;
  };
  [[nodiscard]] static std::optional<Reading> ReadingAt(const Guest& guest, CpuTicks host_ticks) {
    const auto mono = guest.clocks.At(GuestClock::kMono, GuestRun::OnGuest(guest, {host_ticks, host_ticks}));
    if (!mono) return std::nullopt;
    const auto ticks = guest.clocks.When(GuestClock::kMono, mono->lowest);
    if (!ticks) return std::nullopt;
    return Reading{mono->lowest, GuestRun::OnHost(guest, *ticks)};
  }

  // A consumer in the guest: passes each message to TimeBase, and asks for instants of readings of all guests.
  void Consume(const Guest& at) {
    TimeBase consumer;
    for (const Guest::Message& message : at.messages) {
      consumer.OnTime(message.time, message.received);
      const std::optional<Bounds> ticks = at.clocks.When(GuestClock::kMono, message.received);
      if (!ticks) continue;
      const CpuTicks now = GuestRun::OnHost(at, *ticks).lowest;
      for (int i = 0; i < options_.queries; ++i) Ask(consumer, message.received, now);
    }
  }

  // For readings of two guests in the last 1.2 s, at most 2 ms apart.
  void Ask(const TimeBase& consumer, MonoNs received, CpuTicks now) {
    const Guest& of = Pick();
    const Guest& to = Pick();
    const CpuTicks then = now - Later(0, 1.2);
    const std::optional<Reading> reading = ReadingAt(of, then);
    if (!reading) return;
    const std::optional<MonoNs> time = HostTime(reading->host_ticks);
    if (!time) return;
    PhaseFigures& phase = PhaseAt(*time);
    Verdicts& verdicts = IsBeyond(*time) ? phase.beyond : phase.instants;
    const TimeBase::Instant base = consumer.OnBase(of.clock_id, reading->mono, received);
    if (base)
      verdicts.Count(JudgeInterval(run_.BaseAt(base.base_id, reading->host_ticks), base.ns, base.half_width_ns));
    if (&to == &of) return;
    const TimeBase::Instant there = consumer.OnClock(to.clock_id, of.clock_id, reading->mono, received);
    if (there) {
      const auto truth = to.clocks.At(GuestClock::kMono, GuestRun::OnGuest(to, reading->host_ticks));
      verdicts.Count(JudgeInterval(truth, there.ns, there.half_width_ns));
    }
    const std::optional<Reading> other = ReadingAt(to, then + Later(-0.002, 0.002));
    if (!base || !other || IsBeyond(*time)) return;
    const TimeBase::Instant second = consumer.OnBase(to.clock_id, other->mono, received);
    if (!second) return;
    if (TimeBase::Before(base, second)) {
      phase.comparisons.Count(true, reading->host_ticks, other->host_ticks);
    } else {
      phase.comparisons.Count(TimeBase::Before(second, base), other->host_ticks, reading->host_ticks);
    }
  }

  const Guest& Pick() {
    return run_.guests[std::uniform_int_distribution<std::size_t>(0, run_.guests.size() - 1)(random_)];
  }
  // A random time in ticks.
  CpuTicks Later(double least_seconds, double most_seconds) {
    const ClockReading& first = run_.host.readings().front();
    const ClockReading& last = run_.host.readings().back();
    const double per_second =
        static_cast<double>(last.before - first.before) / static_cast<double>(last.mono - first.mono) * 1e9;
    return std::llround(std::uniform_real_distribution<double>(least_seconds, most_seconds)(random_) * per_second);
  }

  const GuestRun& run_;
  const JudgeOptions& options_;
  std::mt19937_64 random_{1};
  std::vector<PhaseFigures> phases_;
};

}  // namespace

Verdict JudgeInterval(const std::optional<Bounds>& truth, std::int64_t ns, std::int64_t half_width) {
  if (!truth) return Verdict::kUnjudged;
  const std::int64_t earliest = ns - half_width;
  const std::int64_t latest = ns + half_width;
  if (earliest <= truth->lowest && truth->highest <= latest) return Verdict::kHolds;
  return truth->highest < earliest || latest < truth->lowest ? Verdict::kMisses : Verdict::kUndecided;
}

void Verdicts::Count(Verdict verdict) {
  switch (verdict) {
    case Verdict::kHolds:
      ++holds;
      break;
    case Verdict::kMisses:
      ++misses;
      break;
    case Verdict::kUndecided:
      ++undecided;
      break;
    case Verdict::kUnjudged:
      ++unjudged;
      break;
  }
}

void Comparisons::Count(bool before, const Bounds& first, const Bounds& second) {
  if (!before) {
    ++unknown;
  } else if (first.highest < second.lowest) {
    ++right;
  } else if (second.highest < first.lowest) {
    ++wrong;
  } else {
    ++undecided;
  }
}

std::vector<PhaseFigures> JudgeRun(GuestRun run, const JudgeOptions& options) {
  for (Guest& guest : run.guests) {
    for (Guest::Message& message : guest.messages) {
      time_quality_t& time = message.time;
      if (time.source != time_quality_t::SOURCE_EXCHANGE) continue;
      time.base_ns += std::llround(options.shift * static_cast<double>(time.half_width_ns));
    }
  }
  return Judge(run, options).Run();
}

bool IsTrue(const std::vector<PhaseFigures>& phases) {
  return std::all_of(phases.begin(), phases.end(), [](const PhaseFigures& phase) {
    return phase.claims.misses == 0 && phase.own.misses == 0 && phase.instants.misses == 0 &&
           phase.comparisons.wrong == 0 && phase.late == 0;
  });
}

}  // namespace axlecast
