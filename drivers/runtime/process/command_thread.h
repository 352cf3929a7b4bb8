#pragma once

#include <atomic>
#include <string>
#include <thread>

#include "core/config/machine_config.h"
#include "drivers/runtime/process/driver.h"
#include "platform/net/lcm_port.h"

namespace axlecast {

// Hears the command port for a driver on a thread of its own, so that an order is acknowledged however busy the bus
// is. The port and the driver outlive it.
class CommandThread {
 public:
  CommandThread(LcmPort& port, const BusConfig& config, Driver& driver);
  ~CommandThread();
  CommandThread(const CommandThread&) = delete;
  CommandThread& operator=(const CommandThread&) = delete;

  // The port no longer hands over messages: the driver cannot be commanded, and should start afresh.
  [[nodiscard]] bool failed() const { return failed_; }

 private:
  void Run();

  LcmPort& port_;
  std::atomic<bool> ending_ = false;
  std::atomic<bool> failed_ = false;
  std::thread thread_;
};

}  // namespace axlecast
