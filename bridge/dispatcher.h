#pragma once

#include <axlecast/command_body_t.hpp>
#include <axlecast/command_status_t.hpp>
#include <axlecast/command_t.hpp>
#include <axlecast/driver_status_t.hpp>
#include <cstdint>
#include <functional>
#include <map>
#include <optional>
#include <string>

#include "bridge/access/authority.h"
#include "bridge/admission.h"
#include "bridge/alarm_keeper.h"
#include "bridge/axis_keeper.h"
#include "bridge/bridge_alarms.h"
#include "bridge/bridge_watch.h"
#include "bridge/command_memory.h"
#include "bridge/command_port.h"
#include "bridge/device_lane.h"
#include "bridge/driver_link.h"
#include "bridge/durable_store.h"
#include "bridge/foreign_watch.h"
#include "bridge/task.h"
#include "bridge/token_desk.h"
#include "drivers/runtime/config/machine_config.h"
#include "drivers/runtime/core/message_sink.h"

namespace axlecast {

// What the bridge stands on. All of it outlives the bridge.
struct BridgePorts {
  DurableStore* store = nullptr;
  MessageSink* commands = nullptr;
  MessageSink* data = nullptr;
  const SigningKey* key = nullptr;  // null: what it says stays unsigned
  std::function<void(const std::string& line)> log;
  std::function<CommandId()> random;  // for tokens
};

// The bridge without its I/O: takes commands of those who may give them, notes them, routes each to the driver of
// its device, one at a time per device (urgent ones beside it), and gives every id exactly one final outcome.
// Publishes COMMAND_STATUS, DRIVER_COMMAND/<bus> and ALARM/bridge. One thread.
class Dispatcher final : private LaneOutput {
 public:
  static constexpr MonoNs kFindWithin = 20 * kSecond;  // after an INDETERMINATE, then FINDING_CANNOT_TELL

  // Takes up what an earlier bridge has left in the store.
  Dispatcher(const MachineConfig& machine, std::int64_t boot_id, BridgePorts ports, Instant now);
  Dispatcher(const Dispatcher&) = delete;
  Dispatcher& operator=(const Dispatcher&) = delete;

  void OnCommand(Bytes message, Instant now);
  void OnDriverStatus(const std::string& channel, Bytes message, Instant now);
  void OnCommandStatus(Bytes message, Instant now);
  // At least every 20 ms.
  void Tick(Instant now);

  [[nodiscard]] const BridgeWatch& watch() const { return watch_; }
  // Messages that could not be read, or were not from whom they should be.
  [[nodiscard]] std::int64_t foreign() const { return foreign_.count(); }

 private:
  struct Bus {
    const BusConfig* config = nullptr;
    DriverLink driver;
    std::map<std::string, DeviceLane> lanes;   // by device
    std::map<std::string, DeviceLane> urgent;  // by device: OperationSpec::urgent waits for nothing else
  };

  // A command on its way in.
  struct Incoming {
    const command_body_t& body;
    Caller caller;
    Admitted admitted;
    command_status_t status;
  };

  void Execute(Incoming incoming, Instant now);
  void Cancel(const Incoming& incoming, Instant now);
  void TellKnown(const command_body_t& body, const std::string& text, Instant now);
  void Accept(Incoming incoming, Instant now);
  [[nodiscard]] std::optional<Refusal> MakeTask(const Incoming& incoming, Task& task, Instant now);
  [[nodiscard]] std::optional<Refusal> Busy(const Bus& bus, const DeviceLane& lane, MonoNs now) const;
  [[nodiscard]] CommandRecord RecordOf(const Incoming& incoming, Instant now) const;
  [[nodiscard]] Refusal NotNoted() const;
  void Refuse(command_status_t status, const Refusal& refusal, Instant now);
  void OnForeign(const std::string& what, Instant now);
  void OnHello(Bus& bus, const driver_status_t& status, Instant now);
  void EndCommand(Task task, Instant now);
  void BeginFinding(const Task& task, command_status_t& status, Instant now);
  void EndFinding(const Task& task, Instant now);
  void Resume(const OpenCommand& command, Instant now);
  void TakeUpLate(Instant now);
  [[nodiscard]] DeviceLane& LaneOf(Bus& bus, const std::string& device, const OperationSpec* operation);

  std::int64_t Send(const Task& task, std::int8_t kind, std::int32_t valid_ms, Instant now) override;
  CommandId NewId() override;
  std::optional<Refusal> BeforeRoute(Task& task, Instant now) override;
  void OnStep(Task& task, Instant now) override;
  void OnEnd(Task task, Instant now) override;

  const MachineConfig& machine_;
  const BridgePorts ports_;
  DurableStore& store_;
  CommandPort port_;
  CommandMemory memory_;
  Authority authority_;
  BridgeWatch watch_;
  BridgeAlarms alarms_;
  AxisKeeper axes_;
  AlarmKeeper marks_;
  TokenDesk tokens_;
  ForeignWatch foreign_;
  std::map<std::string, Bus> buses_;
  std::int64_t own_ids_ = 0;
  bool taken_up_ = false;  // what earlier bridges left in the store
};

}  // namespace axlecast
