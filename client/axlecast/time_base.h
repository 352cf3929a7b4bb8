// For consumers of readings of several hosts: where an instant on the clock of one host lies on the time base of the machine, and on
// the clock of another host, always as an interval that holds the truth. Header only, C++17, reads no clock and needs no LCM library.
//
//   axlecast::TimeBase time;
//   ... in the handler of TIME/.*:   time.OnTime(message, now_ns);   // now_ns: CLOCK_MONOTONIC of this host
//   const auto at = time.OnClock(own_clock_id, position.clock_id, position.mono_ns, now_ns);
//   if (at) use(at.ns, at.half_width_ns);   // CLOCK_MONOTONIC of this host
//
// Not thread-safe. Cost: O(kHistory) per call.
#pragma once

#include <array>
#include <axlecast/time_quality_t.hpp>
#include <cstddef>
#include <cstdint>

namespace axlecast {

class TimeBase {
 public:
  enum class Answer {
    kKnown,
    kNoTime,         // no TIME message with this clock_id has arrived: does `axlecast time` run on that host?
    kNoClaim,        // that host knows of no bound at the instant
    kExpired,        // the instant is too far from the TIME messages that are kept
    kEpochChanged,   // the clock or its base broke at about the instant
    kDifferentBase,  // the two hosts have different roots
  };

  // An instant lies within ns +- half_width_ns. Only where it converts to true do the numbers mean anything.
  struct Instant {
    Answer answer = Answer::kNoTime;
    std::int64_t ns = 0;
    std::int64_t half_width_ns = 0;
    std::int64_t base_id = 0;
    std::uint64_t era = 0;  // of one host: instants of different eras are not comparable

    explicit operator bool() const { return answer == Answer::kKnown; }
  };

  // `machine_id`: messages that state another machine are ignored. 0: all machines are taken.
  explicit TimeBase(std::int64_t machine_id = 0) : machine_id_(machine_id) {}

  void OnTime(const time_quality_t& message, std::int64_t now_ns);

  // Returns the instant of the base at `mono_ns`, an instant on the clock `clock_id`. After the newest TIME message of that host, this
  // is known only while such messages arrive: a host that was suspended continues its clock as if nothing had happened.
  [[nodiscard]] Instant OnBase(std::int64_t clock_id, std::int64_t mono_ns, std::int64_t now_ns) const;
  // Returns the instant on the clock `clock_id` that corresponds to `mono_ns` on the clock `of`. Equal clocks need no TIME message.
  [[nodiscard]] Instant OnClock(std::int64_t clock_id, std::int64_t of, std::int64_t mono_ns,
                                std::int64_t now_ns) const;
  // Returns true if `a` is known to be before `b`.
  [[nodiscard]] static bool Before(const Instant& a, const Instant& b) {
    return a && b && a.base_id == b.base_id && a.ns + a.half_width_ns < b.ns - b.half_width_ns;
  }

  static constexpr std::size_t kClocks = 32;   // hosts; the one that was silent longest is forgotten
  static constexpr std::size_t kHistory = 32;  // messages of a host

 private:
  struct Claim {
    std::int64_t mono_ns = 0;
    std::int64_t base_ns = 0;
    std::int64_t half_width_ns = -1;  // -1: none
    std::int64_t growth_ppb = 0;
    std::int64_t valid_ns = 0;
    std::int64_t base_id = 0;
    std::int64_t boot_id = 0;
    std::int32_t epoch = 0;

    [[nodiscard]] bool Continues(const Claim& other) const {
      return boot_id == other.boot_id && epoch == other.epoch && base_id == other.base_id;
    }
    [[nodiscard]] std::uint64_t Era() const {
      return Mixed(Mixed(static_cast<std::uint64_t>(boot_id), static_cast<std::uint64_t>(base_id)),
                   static_cast<std::uint32_t>(epoch));
    }
    [[nodiscard]] Instant At(std::int64_t mono) const;
  };
  struct Clock {
    std::int64_t id = 0;      // 0: free
    std::uint64_t order = 0;  // of its newest message among all; 0: none
    std::int64_t received_ns = 0;
    std::size_t newest = 0;
    std::size_t size = 0;
    std::array<Claim, kHistory> ring{};

    [[nodiscard]] const Claim& Back(std::size_t i) const { return ring[(newest + kHistory - i) % kHistory]; }
  };

  [[nodiscard]] const Clock* Find(std::int64_t clock_id) const;
  [[nodiscard]] static bool IsSane(const time_quality_t& message);
  [[nodiscard]] static Instant Refuse(Answer answer);
  [[nodiscard]] static Instant Both(const Instant& a, const Instant& b);
  [[nodiscard]] static std::int64_t Growth(std::int64_t distance, std::int64_t ppb);
  [[nodiscard]] static std::uint64_t Mixed(std::uint64_t a, std::uint64_t b) { return (a * 0x100000001B3 + 1) ^ b; }

  static constexpr std::int64_t kLatest = INT64_MAX / 16;      // 18 years: sums of such instants do not overflow
  static constexpr std::int64_t kWidest = 86'400'000'000'000;  // wider claims are ignored

  std::int64_t machine_id_;
  std::uint64_t messages_ = 0;
  std::array<Clock, kClocks> clocks_{};
};

// Returns why an instant is not known, for people.
inline const char* ReasonText(TimeBase::Answer answer) {
  switch (answer) {
    case TimeBase::Answer::kKnown:
      return "the instant is known";
    case TimeBase::Answer::kNoTime:
      return "no TIME message of that host has arrived: does `axlecast time` run there?";
    case TimeBase::Answer::kNoClaim:
      return "that host has no bound on the time base at the moment: see `axlecast status`";
    case TimeBase::Answer::kExpired:
      return "the instant is too far from the TIME messages of that host";
    case TimeBase::Answer::kEpochChanged:
      return "the clock or its time base broke at about that instant";
    case TimeBase::Answer::kDifferentBase:
      return "the two hosts have different time bases";
  }
  return "unknown";
}

// Rounded up. Distances are below kLatest, rates below 1e9.
inline std::int64_t TimeBase::Growth(std::int64_t distance, std::int64_t ppb) {
  const std::int64_t length = distance < 0 ? -distance : distance;
  return (length / 1'000'000 + 1) * ppb / 1'000 + 1;
}

inline bool TimeBase::IsSane(const time_quality_t& message) {
  constexpr std::int32_t kMostGrowth = 1'000'000'000;
  const bool instants =
      message.mono_ns >= 0 && message.mono_ns < kLatest && message.base_ns >= 0 && message.base_ns < kLatest;
  return message.clock_id != 0 && instants && message.half_width_ns >= -1 && message.half_width_ns < kWidest &&
         message.growth_ppb >= 0 && message.growth_ppb <= kMostGrowth && message.valid_ms >= 0;
}

inline void TimeBase::OnTime(const time_quality_t& message, std::int64_t now_ns) {
  if (machine_id_ != 0 && message.machine_id != 0 && message.machine_id != machine_id_) return;
  if (!IsSane(message)) return;
  Clock* clock = nullptr;
  for (Clock& each : clocks_) {
    if (each.id == message.clock_id) {
      clock = &each;
      break;
    }
    if (clock == nullptr || each.order < clock->order) clock = &each;  // a free one has order 0
  }
  if (clock->id != message.clock_id) {
    *clock = Clock{};
    clock->id = message.clock_id;
  } else if (clock->size > 0 && message.mono_ns <= clock->Back(0).mono_ns) {
    return;
  }
  clock->order = ++messages_;
  clock->received_ns = now_ns;
  clock->newest = (clock->newest + 1) % kHistory;
  clock->size = clock->size < kHistory ? clock->size + 1 : kHistory;
  Claim& claim = clock->ring[clock->newest];
  claim.mono_ns = message.mono_ns;
  claim.base_ns = message.base_ns;
  claim.half_width_ns = message.grade == time_quality_t::GRADE_PROVEN ? message.half_width_ns : -1;
  claim.growth_ppb = message.growth_ppb;
  claim.valid_ns = std::int64_t{message.valid_ms} * 1'000'000;
  claim.base_id = message.base_id;
  claim.boot_id = message.boot_id;
  claim.epoch = message.epoch;
}

inline const TimeBase::Clock* TimeBase::Find(std::int64_t clock_id) const {
  for (const Clock& clock : clocks_) {
    if (clock.id == clock_id && clock_id != 0) return &clock;
  }
  return nullptr;
}

inline TimeBase::Instant TimeBase::Refuse(Answer answer) {
  Instant instant;
  instant.answer = answer;
  return instant;
}

inline TimeBase::Instant TimeBase::Claim::At(std::int64_t mono) const {
  if (half_width_ns < 0 || base_id == 0) return Refuse(Answer::kNoClaim);
  const std::int64_t distance = mono - mono_ns;
  if (distance > valid_ns || -distance > valid_ns) return Refuse(Answer::kExpired);
  Instant instant;
  instant.answer = Answer::kKnown;
  instant.ns = base_ns + distance;
  instant.half_width_ns = half_width_ns + Growth(distance, growth_ppb);
  instant.base_id = base_id;
  instant.era = Era();
  return instant;
}

// Both intervals hold the instant, so that it lies in their intersection.
inline TimeBase::Instant TimeBase::Both(const Instant& a, const Instant& b) {
  if (!a) return b ? b : a;
  if (!b) return a;
  const std::int64_t first =
      a.ns - a.half_width_ns > b.ns - b.half_width_ns ? a.ns - a.half_width_ns : b.ns - b.half_width_ns;
  const std::int64_t last =
      a.ns + a.half_width_ns < b.ns + b.half_width_ns ? a.ns + a.half_width_ns : b.ns + b.half_width_ns;
  if (first > last) return Refuse(Answer::kEpochChanged);
  Instant instant = a;
  instant.ns = first + (last - first) / 2;
  instant.half_width_ns = last - instant.ns;
  return instant;
}

inline TimeBase::Instant TimeBase::OnBase(std::int64_t clock_id, std::int64_t mono_ns, std::int64_t now_ns) const {
  const Clock* clock = Find(clock_id);
  if (clock == nullptr) return Refuse(Answer::kNoTime);
  if (mono_ns < 0 || mono_ns >= kLatest) return Refuse(Answer::kExpired);
  const Claim& newest = clock->Back(0);
  if (mono_ns >= newest.mono_ns) {
    return now_ns - clock->received_ns > newest.valid_ns ? Refuse(Answer::kExpired) : newest.At(mono_ns);
  }
  for (std::size_t i = 1; i < clock->size; ++i) {
    const Claim& before = clock->Back(i);
    if (before.mono_ns > mono_ns) continue;
    const Claim& after = clock->Back(i - 1);
    if (!before.Continues(after)) return Refuse(Answer::kEpochChanged);
    return Both(before.At(mono_ns), after.At(mono_ns));
  }
  return Refuse(Answer::kExpired);  // older than all: whether the epoch changed since then is not known
}

inline TimeBase::Instant TimeBase::OnClock(std::int64_t clock_id, std::int64_t of, std::int64_t mono_ns,
                                           std::int64_t now_ns) const {
  if (clock_id == of && of != 0) {
    Instant same;
    same.answer = Answer::kKnown;
    same.ns = mono_ns;
    return same;
  }
  const Instant base = OnBase(of, mono_ns, now_ns);
  if (!base) return base;
  const Clock* clock = Find(clock_id);
  if (clock == nullptr) return Refuse(Answer::kNoTime);
  // A first guess by the newest claim; then the claims next to that instant decide.
  const Claim& newest = clock->Back(0);
  const std::int64_t guess = newest.mono_ns + (base.ns - newest.base_ns);
  const Instant there = OnBase(clock_id, guess, now_ns);
  if (!there) return there;
  if (there.base_id != base.base_id) return Refuse(Answer::kDifferentBase);
  const std::int64_t correction = base.ns - there.ns;
  const std::int64_t width = base.half_width_ns + there.half_width_ns;
  Instant instant;
  instant.answer = Answer::kKnown;
  instant.ns = guess + correction;
  instant.half_width_ns = width + Growth((correction < 0 ? -correction : correction) + width, newest.growth_ppb);
  instant.base_id = base.base_id;
  instant.era = Mixed(base.era, there.era);
  return instant;
}

}  // namespace axlecast
