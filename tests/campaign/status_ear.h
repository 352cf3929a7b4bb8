#pragma once

#include <atomic>
#include <cstdint>
#include <map>
#include <mutex>
#include <set>
#include <string>
#include <thread>
#include <utility>

#include "client/axlecast/command.h"
#include "drivers/io/lcm_port.h"

namespace axlecast {

// Hears every COMMAND_STATUS on a command port, whoever it is for, and keeps which outcomes each body under an id was
// ever given: a cancel, or the same id with another body, may be refused.
class StatusEar {
 public:
  StatusEar(const std::string& url, const std::string& prefix);
  ~StatusEar();
  StatusEar(const StatusEar&) = delete;
  StatusEar& operator=(const StatusEar&) = delete;

  [[nodiscard]] const std::string& problem() const { return port_.problem(); }
  // Final states, and after an INDETERMINATE its findings.
  using Body = std::pair<CommandId, std::int64_t>;  // and its digest
  struct Told {
    std::set<int> states;
    std::set<int> findings;
  };
  [[nodiscard]] std::map<Body, Told> told() const;

 private:
  void Run();

  LcmPort port_;
  mutable std::mutex mutex_;
  std::map<Body, Told> told_;
  std::atomic<bool> ending_ = false;
  std::thread thread_;
};

}  // namespace axlecast
