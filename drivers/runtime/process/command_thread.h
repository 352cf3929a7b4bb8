#pragma once

#include <atomic>
#include <string>
#include <thread>

#include "core/config/machine_config.h"
#include "drivers/runtime/process/driver.h"
#include "platform/net/lcm_port.h"

namespace axlecast {

// Receives the command port of a driver on its own thread, so that a command is acknowledged at once, even if the bus is
// busy. The port and the driver outlive it.
class CommandThread {
 public:
  CommandThread(LcmPort& port, const BusConfig& config, Driver& driver);
  ~CommandThread();
  CommandThread(const CommandThread&) = delete;
  CommandThread& operator=(const CommandThread&) = delete;

  // Returns true if the port no longer delivers messages: the driver receives no commands, and should be restarted.
  [[nodiscard]] bool failed() const { return failed_; }

 private:
  void Run();

  LcmPort& port_;
  std::atomic<bool> ending_ = false;
  std::atomic<bool> failed_ = false;
  std::thread thread_;
};

}  // namespace axlecast
