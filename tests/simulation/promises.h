#pragma once

#include <cstdint>
#include <functional>
#include <map>
#include <string>
#include <string_view>
#include <vector>

#include "core/base/text.h"
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
  void Count(std::string_view what, std::int64_t number = 1) {
    auto found = counts_.find(what);
    if (found == counts_.end()) found = counts_.emplace(what, 0).first;
    found->second += number;
  }

  [[nodiscard]] const std::vector<std::string>& breaches() const { return breaches_; }
  [[nodiscard]] std::int64_t count() const { return count_; }
  using Counts = std::map<std::string, std::int64_t, std::less<>>;
  [[nodiscard]] const Counts& counts() const { return counts_; }
  // "12.345678 s"
  [[nodiscard]] static std::string TimeText(MonoNs time) {
    return Text("%12.6f s", static_cast<double>(time) * 1e-9);
  }

 private:
  static constexpr std::size_t kKept = 20;

  const Schedule& schedule_;
  std::vector<std::string> breaches_;
  std::int64_t count_ = 0;
  Counts counts_;
};

}  // namespace axlecast::simulation
