#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "tests/time_guests/guest_run.h"

namespace axlecast {

enum class Verdict {
  kHolds,      // the interval contains all bounds of the truth
  kMisses,     // it contains none of them
  kUndecided,  // the edge of the interval is within the bounds of the truth
  kUnjudged,   // the truth is not known: it is outside of the readings
};

// Compares the interval ns +- half_width with the bounds of the truth.
[[nodiscard]] Verdict JudgeInterval(const std::optional<Bounds>& truth, std::int64_t ns, std::int64_t half_width);

struct Verdicts {
  std::int64_t holds = 0;
  std::int64_t misses = 0;
  std::int64_t undecided = 0;
  std::int64_t unjudged = 0;

  void Count(Verdict verdict);
};

// What TimeBase::Before answers for pairs of instants.
struct Comparisons {
  std::int64_t right = 0;
  std::int64_t wrong = 0;      // true, although the instants are in the other order
  std::int64_t undecided = 0;  // true, and the instants are closer than the bounds of the truth
  std::int64_t unknown = 0;    // neither is known to be before the other

  void Count(bool before, const Bounds& first, const Bounds& second);
};

// A part of the test; parts of the same name are one.
struct PhaseFigures {
  std::string name;
  Verdicts claims;  // published by a guest that is not the root
  Verdicts own;     // published by the root of its own clock
  // Given to a consumer by TimeBase for a reading of a guest: on the base, or on the clock of another guest.
  Verdicts instants;
  Comparisons comparisons;
  // Claims and instants while a limit is exceeded on which they rest. They may miss the truth.
  Verdicts beyond;
  std::int64_t late = 0;  // claims later than kWithdrawal after the cause of their end
  MonoNs last = 0;        // longest time from a cause to a claim before its end
  MonoNs starved = 0;     // extends kWithdrawal: the longest gap between the readings of the guest meanwhile
  // Of claims, in ns.
  std::vector<std::int64_t> half_widths;
  std::vector<std::int64_t> from_middle;  // the truth
  // What chronyd claimed of UNIX time against the root's, and the true error, in ns. Its claims are not proven: false ones are no failure.
  Verdicts utc;
  Verdicts utc_published;  // in TIME messages
  std::vector<std::int64_t> utc_half_widths;
  std::vector<std::int64_t> utc_errors;
  std::int64_t oracle_error = 0;  // greatest width of the bounds of the truth
};

inline constexpr MonoNs kWithdrawal = 2 * kSecond;

struct JudgeOptions {
  // Half widths by which every claim of a guest that is not the root is moved first. The judge must find these.
  double shift = 0;
  int queries = 4;  // of a consumer after each message
};

// Compares all that the guests published, and what consumers in the guests make of it, with the truth.
[[nodiscard]] std::vector<PhaseFigures> JudgeRun(GuestRun run, const JudgeOptions& options);

// Returns true if nothing misses the truth.
[[nodiscard]] bool IsTrue(const std::vector<PhaseFigures>& phases);

}  // namespace axlecast
