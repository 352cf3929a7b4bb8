#pragma once

#include <axlecast/command_body_t.hpp>
#include <axlecast/command_status_t.hpp>
#include <axlecast/command_t.hpp>
#include <axlecast/driver_status_t.hpp>
#include <cstdint>
#include <deque>
#include <map>
#include <string>

#include "bridge/admission.h"
#include "bridge/bridge_watch.h"
#include "bridge/device_lane.h"
#include "bridge/driver_link.h"
#include "bridge/journal.h"
#include "bridge/reference_memory.h"
#include "bridge/task.h"
#include "drivers/runtime/config/machine_config.h"
#include "drivers/runtime/core/message_sink.h"

namespace axlecast {

// The bridge without its I/O: takes commands, routes each to the driver of its device, one at a time per device
// (urgent ones beside it), and gives every id exactly one final outcome. Publishes COMMAND_STATUS and
// DRIVER_COMMAND/<bus> to `sink`. One thread.
class Dispatcher final : private LaneOutput {
 public:
  static constexpr MonoNs kFindWithin = 20 * kSecond;  // after an INDETERMINATE, then FINDING_CANNOT_TELL

  Dispatcher(const MachineConfig& machine, std::int64_t boot_id, Journal& journal, MessageSink& sink, Instant now);
  Dispatcher(const Dispatcher&) = delete;
  Dispatcher& operator=(const Dispatcher&) = delete;

  void OnCommand(Bytes message, Instant now);
  void OnDriverStatus(const std::string& channel, Bytes message, Instant now);
  void OnCommandStatus(Bytes message, Instant now) { watch_.OnStatus(message, now.mono); }
  // At least every 20 ms.
  void Tick(Instant now);

  [[nodiscard]] const BridgeWatch& watch() const { return watch_; }
  [[nodiscard]] std::int64_t malformed() const { return malformed_; }  // messages that could not be read

 private:
  struct Bus {
    const BusConfig* config = nullptr;
    DriverLink driver;
    std::map<std::string, DeviceLane> lanes;   // by device
    std::map<std::string, DeviceLane> urgent;  // by device: OperationSpec::urgent waits for nothing else
  };

  void Execute(const command_t& envelope, const command_body_t& body, Instant now);
  void Cancel(const command_body_t& body, const Admitted& admitted, Instant now);
  void Accept(const command_body_t& body, const Admitted& admitted, command_status_t status, Instant now);
  [[nodiscard]] std::optional<Refusal> Busy(const Bus& bus, const DeviceLane& lane, MonoNs now) const;
  void Refuse(command_status_t status, const Refusal& refusal, Instant now);
  void TurnAway(const command_status_t& status, Instant now);
  void OnHello(Bus& bus, const driver_status_t& status);
  void EndCommand(Task task, Instant now);
  void EndFinding(const Task& task, Instant now);
  void Publish(command_status_t status, Instant now);

  std::int64_t Send(const Task& task, std::int8_t kind, std::int32_t valid_ms, Instant now) override;
  CommandId NewId() override;
  void OnStep(Task& task, Instant now) override;
  void OnEnd(Task task, Instant now) override;

  const MachineConfig& machine_;
  const std::int64_t boot_id_;
  Journal& journal_;
  MessageSink& sink_;
  BridgeWatch watch_;
  ReferenceMemory references_;
  std::map<std::string, Bus> buses_;
  std::map<std::string, std::int64_t> seq_;  // by channel
  std::int64_t epoch_;
  std::int64_t own_ids_ = 0;
  std::deque<CommandId> turned_away_;  // the newest kTurnedAway that the journal had no room for
  std::int64_t malformed_ = 0;
};

}  // namespace axlecast
