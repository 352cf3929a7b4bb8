#pragma once

#include <cstdint>
#include <map>
#include <string>
#include <vector>

#include "tests/simulation/schedule.h"

namespace axlecast::simulation {

// What must always hold, and what was compared for it. A breach is a sentence with the time.
class Promises {
 public:
  explicit Promises(const Schedule& schedule) : schedule_(schedule) {}

  void Breach(const std::string& what) {
    ++count_;
    if (breaches_.size() < kKept) breaches_.push_back(TimeText(schedule_.now()) + "  " + what);
  }
  // Counts something that was compared with the truth, or was done: "positions", "commands", ...
  void Count(const std::string& what, std::int64_t number = 1) { counts_[what] += number; }

  [[nodiscard]] const std::vector<std::string>& breaches() const { return breaches_; }
  [[nodiscard]] std::int64_t count() const { return count_; }
  [[nodiscard]] const std::map<std::string, std::int64_t>& counts() const { return counts_; }
  // "12.345678 s"
  [[nodiscard]] static std::string TimeText(MonoNs time);

 private:
  static constexpr std::size_t kKept = 20;

  const Schedule& schedule_;
  std::vector<std::string> breaches_;
  std::int64_t count_ = 0;
  std::map<std::string, std::int64_t> counts_;
};

}  // namespace axlecast::simulation
