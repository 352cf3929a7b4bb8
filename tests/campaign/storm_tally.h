#pragma once

#include <cstdint>
#include <map>
#include <mutex>
#include <string>

namespace axlecast {

// The results of a storm of commands, reported by many threads.
class StormTally {
 public:
  void Outcome(const std::string& operation, const std::string& outcome, std::int64_t effects);
  // A breach of the property; printed at once.
  void Breach(const std::string& what);

  [[nodiscard]] std::int64_t breaches() const;
  [[nodiscard]] std::int64_t ended() const;
  // Operations, outcomes and effects as a table.
  void Print() const;

 private:
  mutable std::mutex mutex_;
  std::map<std::string, std::map<std::string, std::int64_t>> outcomes_;  // by operation and outcome
  std::map<std::string, std::int64_t> effects_;                          // by operation
  std::int64_t ended_ = 0;
  std::int64_t breaches_ = 0;
};

}  // namespace axlecast
