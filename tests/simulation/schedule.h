#pragma once

#include <algorithm>
#include <cstdint>
#include <functional>
#include <utility>
#include <vector>

#include "core/base/time.h"

namespace axlecast::simulation {

// Everything that happens in a simulation, in the order of its time. Time is that of the simulated world, in ns from 0: the clocks of
// hosts differ from it (host_clock.h). Actions of the same time run in the order in which they were given.
class Schedule {
 public:
  using Action = std::function<void()>;

  [[nodiscard]] MonoNs now() const { return now_; }
  void At(MonoNs time, Action action) {
    entries_.push_back({std::max(time, now_), count_++, std::move(action)});
    std::push_heap(entries_.begin(), entries_.end());
  }
  void After(MonoNs delay, Action action) { At(now_ + delay, std::move(action)); }
  // Runs all actions that are due until then, also those that they give.
  void RunUntil(MonoNs until) {
    while (!entries_.empty() && entries_.front().at <= until) {
      std::pop_heap(entries_.begin(), entries_.end());
      Entry entry = std::move(entries_.back());
      entries_.pop_back();
      now_ = entry.at;
      entry.action();
    }
    now_ = until;
  }
  // Drops all actions.
  void Clear() { entries_.clear(); }
  [[nodiscard]] std::int64_t count() const { return count_; }

 private:
  struct Entry {
    MonoNs at;
    std::int64_t number;
    Action action;
    bool operator<(const Entry& other) const { return std::pair(at, number) > std::pair(other.at, other.number); }
  };

  MonoNs now_ = 0;
  std::int64_t count_ = 0;
  std::vector<Entry> entries_;  // a heap
};

}  // namespace axlecast::simulation
