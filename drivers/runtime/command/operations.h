#pragma once

#include <cstdint>
#include <string>
#include <utility>
#include <vector>

#include "core/base/log.h"
#include "core/base/result.h"
#include "core/base/time.h"
#include "core/config/machine_config.h"
#include "core/device/device.h"
#include "drivers/runtime/axis/device_publisher.h"
#include "drivers/runtime/command/driver_command_server.h"

namespace axlecast {

// Executes commands: checks interlocks, starts the command on its device or applies it to the axis, and reports the
// outcome. Used by the bus's thread only.
class Operations {
 public:
  Operations(const Family& family, DriverCommandServer& server, const Timebase& time, Log log)
      : family_(family), server_(server), time_(time), log_(std::move(log)) {}

  void Add(const DeviceConfig& config, DevicePublisher& channel, Device& device);

  // Takes the commands, cancellations and PREPAREs that came since the last call. Cheap if none came.
  void Poll(MonoNs now);
  // Takes an outcome of a command from the device that executes it.
  void OnOutcome(const std::string& device, const CommandId& id, const Outcome& outcome);

  // Cancels the commands that have not touched their device yet: the driver stops.
  void Abandon(MonoNs now);
  // Reports the writes of the commands that have not ended: the driver is about to send GOODBYE.
  void CountWrites();
  // Returns true while a device executes a command.
  [[nodiscard]] bool Busy() const;

 private:
  struct Held {
    CommandId id;
    std::int64_t writes_before;  // writes to memory of limited endurance, when the command began
  };
  struct Target {
    const DeviceConfig* config;
    DevicePublisher* channel;
    Device* device;
    std::vector<Held> held;  // at most one usual and one urgent command
  };

  [[nodiscard]] static std::int32_t WritesOf(const Target& target, const Held& held);
  // Returns the end of target.held if the target does not execute the command.
  [[nodiscard]] static std::vector<Held>::iterator FindHeld(Target& target, const CommandId& id);
  [[nodiscard]] Target* Find(const std::string& device);
  void Begin(Target& target, const DriverCommand& command, MonoNs now);
  void Cancel(Target& target, const CommandId& id, std::int32_t reason, const char* text, MonoNs now);
  [[nodiscard]] Result<> Check(const Target& target, const DriverCommand& command,
                               const OperationSpec* operation) const;
  // Returns what Begin would report.
  [[nodiscard]] Outcome Prepare(const Target& target, const DriverCommand& command, MonoNs now) const;

  const Family& family_;
  DriverCommandServer& server_;
  const Timebase& time_;
  Log log_;
  std::vector<Target> targets_;
};

}  // namespace axlecast
