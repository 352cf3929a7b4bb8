#include "tests/campaign/storm_tally.h"

#include <cinttypes>
#include <cstdio>

namespace axlecast {

void StormTally::Outcome(const std::string& operation, const std::string& outcome, std::int64_t effects) {
  const std::lock_guard lock(mutex_);
  ++outcomes_[operation][outcome];
  effects_[operation] += effects;
  ++ended_;
}

void StormTally::Breach(const std::string& what) {
  const std::lock_guard lock(mutex_);
  ++breaches_;
  std::printf("  BREACH %s\n", what.c_str());
}

std::int64_t StormTally::breaches() const {
  const std::lock_guard lock(mutex_);
  return breaches_;
}

std::int64_t StormTally::ended() const {
  const std::lock_guard lock(mutex_);
  return ended_;
}

void StormTally::Print() const {
  const std::lock_guard lock(mutex_);
  for (const auto& [operation, outcomes] : outcomes_) {
    std::printf("  %s, %" PRId64 " effects:\n", operation.c_str(), effects_.at(operation));
    for (const auto& [outcome, count] : outcomes) std::printf("    %8" PRId64 "  %s\n", count, outcome.c_str());
  }
}

}  // namespace axlecast
