#pragma once

#include <cstdint>
#include <optional>
#include <string>

#include <axlecast/time_quality_t.hpp>

#include "core/base/time.h"
#include "core/time/offset_bound.h"

namespace axlecast {

// The clocks of this host, read one after the other: raw_before, mono, boot, raw_after. In ns.
struct HostClocks {
  MonoNs raw_before = 0;  // CLOCK_MONOTONIC_RAW: no daemon changes its rate
  MonoNs mono = 0;        // CLOCK_MONOTONIC: the clock of all published instants
  MonoNs boot = 0;        // CLOCK_BOOTTIME: also runs while the host is suspended
  MonoNs raw_after = 0;
};

// Keeps the bound between CLOCK_MONOTONIC of this host and the time base, which is CLOCK_MONOTONIC_RAW of one host, the root. It makes
// the claims of TIME/<host>. Pure: clocks and exchanges are arguments.
//
// A claim rests on two limits that the machine file states: the rates of two CLOCK_MONOTONIC_RAW differ by at most max_rate_ppb, and
// CLOCK_MONOTONIC runs within max_slew_ppb of CLOCK_MONOTONIC_RAW. If one is seen to be exceeded, the claim ends and a new epoch begins.
class TimeKeeper {
 public:
  struct Limits {
    std::int64_t max_rate_ppb = 100'000;
    std::int64_t max_slew_ppb = 1'000'000;
  };

  static constexpr MonoNs kHoldover = kSecond;           // the state is HOLDOVER without an exchange for this time
  static constexpr MonoNs kLost = 1'500 * kMillisecond;  // and there is no claim after this time
  static constexpr MonoNs kDoubt = 2 * kSecond;          // time without a claim after a new epoch
  // A limit that is exceeded is often noticed only after some seconds, and again after each claim. The time without a claim therefore
  // doubles up to kLongestDoubt if the limit was exceeded within kForgotten before.
  static constexpr MonoNs kLongestDoubt = 64 * kSecond;
  static constexpr MonoNs kForgotten = 300 * kSecond;
  static constexpr MonoNs kValid = 1'000 * kMillisecond;  // distance from mono_ns for which a claim holds

  // On the root, `own_base_id` is the id of its clock, not 0; elsewhere it is 0.
  TimeKeeper(const Limits& limits, std::int64_t own_base_id);

  // The clocks, at least every 200 ms: between two calls, a change of the rate of CLOCK_MONOTONIC is not seen.
  void OnClocks(const HostClocks& clocks);
  // An answer of the root, whose base has the id `base_id`. Returns false if it proves nothing and was not used.
  [[nodiscard]] bool OnExchange(const TimeExchange& exchange, std::int64_t base_id);

  // Sets the fields of the message that state the claim at the newest OnClocks: mono_ns, base_id to epoch, base to state, rtt_min_ns,
  // exchanges, and reason.
  void Describe(time_quality_t& message) const;
  [[nodiscard]] std::int32_t epoch() const { return epoch_; }

 private:
  [[nodiscard]] bool IsRoot() const { return own_base_id_ != 0; }
  void CheckSlew(const HostClocks& clocks);
  void BreakEpoch(const std::string& reason, MonoNs doubt = kDoubt);
  // Ends the epoch because a limit was seen to be exceeded.
  void BreakLimit(const std::string& reason);
  [[nodiscard]] std::int8_t State() const;
  [[nodiscard]] std::optional<OffsetBound::Range> Offset() const;
  [[nodiscard]] std::string Reason() const;
  [[nodiscard]] MonoNs ShortestTrip() const;

  Limits limits_;
  std::int64_t own_base_id_;
  std::int64_t base_id_;
  OffsetBound bound_;
  std::optional<HostClocks> clocks_;
  std::int32_t epoch_ = 0;
  std::optional<MonoNs> exchanged_;  // CLOCK_MONOTONIC_RAW of the newest exchange of this epoch
  MonoNs doubt_until_ = 0;           // CLOCK_MONOTONIC_RAW
  std::string doubt_;
  MonoNs limit_doubt_ = 0;                // after the last exceeded limit; 0: none was
  std::optional<MonoNs> limit_exceeded_;  // CLOCK_MONOTONIC_RAW of it
  std::int64_t exchanges_ = 0;
  // Shortest trips of this minute and of the one before.
  MonoNs minute_began_ = 0;
  MonoNs shortest_ = kNever;
  MonoNs shortest_before_ = kNever;
};

}  // namespace axlecast
