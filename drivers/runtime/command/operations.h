#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "core/base/log.h"
#include "core/base/time.h"
#include "core/config/machine_config.h"
#include "core/device/device.h"
#include "drivers/runtime/axis/device_publisher.h"
#include "drivers/runtime/command/driver_command_server.h"

namespace axlecast {

// Between the order desk and the devices: judges an order by what holds now, hands it to its device or carries it
// out on its channel, and takes the outcome back. The bus's thread only.
class Operations {
 public:
  Operations(const Family& family, DriverCommandServer& desk, const Timebase& time, Log log)
      : family_(family), desk_(desk), time_(time), log_(std::move(log)) {}

  void Add(const DeviceConfig& config, DevicePublisher& channel, Device& device);

  // Takes what the bridge has ordered, asked or cancelled since the last call; cheap when that is nothing.
  void Poll(MonoNs now);
  // How an order stands, from the device that holds it.
  void OnOutcome(const std::string& device, const CommandId& id, const Outcome& outcome);

  // The driver stops: orders that have not touched their device yet are cancelled.
  void Abandon(MonoNs now);
  // The driver says GOODBYE: what orders that have not ended wrote until now.
  void CountWrites();
  // A device holds an order.
  [[nodiscard]] bool Busy() const;

 private:
  struct Held {
    CommandId id;
    std::int64_t writes_before;  // of the device's limited memory, when the order began
  };
  struct Target {
    const DeviceConfig* config;
    DevicePublisher* channel;
    Device* device;
    std::vector<Held> held;  // at most one, and an urgent one
  };

  [[nodiscard]] static std::int32_t WritesOf(const Target& target, const Held& held);
  [[nodiscard]] static bool Holds(const Target& target, const CommandId& id);
  [[nodiscard]] Target* Find(const std::string& device);
  void Begin(Target& target, const DriverCommand& order, MonoNs now);
  void Cancel(Target& target, const CommandId& id, std::int32_t reason, const char* text, MonoNs now);
  [[nodiscard]] std::optional<Outcome> Refuse(const Target& target, const DriverCommand& order,
                                              const OperationSpec* operation) const;
  // What Begin would say.
  [[nodiscard]] Outcome Prepare(const Target& target, const DriverCommand& order, MonoNs now) const;

  const Family& family_;
  DriverCommandServer& desk_;
  const Timebase& time_;
  Log log_;
  std::vector<Target> targets_;
};

}  // namespace axlecast
