#pragma once

#include <atomic>
#include <map>
#include <mutex>
#include <set>
#include <string>
#include <thread>

#include "client/axlecast/command.h"
#include "platform/net/lcm_port.h"

namespace axlecast {

// Receives every COMMAND_STATUS on a command port, for any client, and keeps all outcomes of each id.
class StatusListener {
 public:
  StatusListener(const std::string& url, const std::string& prefix);
  ~StatusListener();
  StatusListener(const StatusListener&) = delete;
  StatusListener& operator=(const StatusListener&) = delete;

  [[nodiscard]] const std::string& problem() const { return port_.problem(); }
  // Final states, and after an INDETERMINATE its findings.
  struct Told {
    std::set<int> states;
    std::set<int> findings;
  };
  [[nodiscard]] std::map<CommandId, Told> told() const;

 private:
  void Run();

  LcmPort port_;
  mutable std::mutex mutex_;
  std::map<CommandId, Told> told_;
  std::atomic<bool> ending_ = false;
  std::thread thread_;
};

}  // namespace axlecast
