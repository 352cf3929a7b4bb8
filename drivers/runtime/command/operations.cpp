#include "drivers/runtime/command/operations.h"

#include <algorithm>
#include <axlecast/command_status_t.hpp>
#include <axlecast/device_info_t.hpp>

#include "core/command/commands.h"
#include "core/device/operation.h"
#include "core/messages/enum_names.h"
#include "drivers/kit/command_runner.h"
#include "drivers/runtime/command/axis_commands.h"

namespace axlecast {
namespace {

Outcome Refused(const Error& error) {
  return {.state = CommandState::kRejected, .reason = error.reason, .text = error.text, .changes = {}};
}

// "eeprom_write address=72 data=A1"
std::string CommandText(const DriverCommand& command) {
  std::string text = command.operation;
  for (const auto& [key, value] : command.arguments) text += ' ' + key + '=' + value;
  return text;
}

Outcome OutcomeOf(const Result<Outcome>& result) { return result ? *result : Refused(result.error()); }

}  // namespace

std::int32_t Operations::WritesOf(const Target& target, const Held& held) {
  return static_cast<std::int32_t>(target.channel->nv_writes() - held.writes_before);
}

std::vector<Operations::Held>::iterator Operations::FindHeld(Target& target, const CommandId& id) {
  return std::find_if(target.held.begin(), target.held.end(), [&](const Held& held) { return held.id == id; });
}

void Operations::Add(const DeviceConfig& config, DevicePublisher& channel, Device& device) {
  targets_.push_back({.config = &config, .channel = &channel, .device = &device, .held = {}});
}

void Operations::Poll(MonoNs now) {
  while (const auto cancel = server_.TakeCancel()) {
    if (Target* target = Find(cancel->device)) {
      Cancel(*target, cancel->command.id, command_status_t::REASON_CANCELLED, "cancelled before it began", now);
    }
  }
  while (const auto asked = server_.TakePrepare()) {
    if (const Target* target = Find(asked->device)) {
      server_.ReportPrepared(asked->command.id, Prepare(*target, asked->command, now),
                             target->channel->summary().datum_epoch);
    }
  }
  while (const auto taken = server_.Take()) {
    if (Target* target = Find(taken->device)) Begin(*target, taken->command, now);
  }
}

void Operations::Begin(Target& target, const DriverCommand& command, MonoNs now) {
  target.held.push_back({command.id, target.channel->nv_writes()});
  log_(LogLevel::kDebug, target.config->name + ": " + command.operation + " begins, id " + IdText(command.id));
  const OperationSpec* operation = FindOperation(family_, command.operation);
  if (const Result<> allowed = Check(target, command, operation); !allowed) {
    return OnOutcome(target.config->name, command.id, Refused(allowed.error()));
  }
  if (!IsOfRuntime(family_, *operation)) return target.device->Begin(command, now);
  OnOutcome(target.config->name, command.id,
            OutcomeOf(ExecuteAxisCommand(*target.channel, command, time_.Utime(now))));
}

Outcome Operations::Prepare(const Target& target, const DriverCommand& command, MonoNs now) const {
  const OperationSpec* operation = FindOperation(family_, command.operation);
  if (const Result<> allowed = Check(target, command, operation); !allowed) return Refused(allowed.error());
  if (IsOfRuntime(family_, *operation)) {
    return OutcomeOf(PrepareAxisCommand(*target.channel, command, time_.Utime(now)));
  }
  if (const auto valid = target.device->Validate(command, now); !valid) return RefusedOutcome(valid.error());
  if (operation->needs_standstill) {
    if (const auto still = CheckStandstill(target.channel->MotionAt(now)); !still)
      return RefusedOutcome(still.error());
  }
  Outcome outcome{.state = CommandState::kSucceeded, .text = "would do " + CommandText(command), .changes = {}};
  const std::int32_t writes = operation->writes != nullptr ? operation->writes(command.arguments) : 0;
  if (writes > 0) outcome.text += "; writes the device's memory at most " + std::to_string(writes) + " times";
  if (family_.has_position) {
    outcome.changes.push_back({"position", ValueText(target.channel->summary().value), ""});
  }
  return outcome;
}

Result<> Operations::Check(const Target& target, const DriverCommand& command,
                           const OperationSpec* operation) const {
  using Reason = command_status_t;
  if (operation == nullptr || operation->executed_by_bridge) {
    return Failure(OperationNames(family_), Reason::REASON_UNKNOWN_OPERATION);
  }
  const DevicePublisher::Summary now = target.channel->summary();
  if (command.expect_epoch >= 0 && command.expect_epoch != now.datum_epoch) {
    return Failure("datum_epoch is " + std::to_string(now.datum_epoch) + ", not " +
                       std::to_string(command.expect_epoch) + ": look at the position again, then repeat",
                   Reason::REASON_EPOCH);
  }
  if (operation->needs_permit && target.config->permit_required) {
    if (Result<> permit = server_.CheckPermit(target.config->name, command.operation); !permit) return permit;
  }
  // An urgent command is tried even if the device seems to be offline.
  if (IsOfRuntime(family_, *operation) || operation->urgent) return {};
  if (now.state == device_info_t::STATE_OFFLINE) {
    return Failure("the device is offline: see DEVICE/" + target.config->name, Reason::REASON_DEVICE_OFFLINE);
  }
  if (now.state == device_info_t::STATE_STARTING) {
    return Failure("the device is still starting: repeat the command when it is online",
                   Reason::REASON_DEVICE_OFFLINE);
  }
  return {};
}

void Operations::Cancel(Target& target, const CommandId& id, std::int32_t reason, const char* text, MonoNs now) {
  if (FindHeld(target, id) == target.held.end() || !target.device->Cancel(id, now)) return;
  OnOutcome(target.config->name, id,
            {.state = CommandState::kCancelled, .reason = reason, .text = text, .changes = {}});
}

void Operations::OnOutcome(const std::string& device, const CommandId& id, const Outcome& outcome) {
  Target* target = Find(device);
  if (target == nullptr) return;
  const auto held = FindHeld(*target, id);
  if (held == target->held.end()) return;
  const std::int32_t writes = WritesOf(*target, *held);
  if (outcome.IsFinal()) {
    target->held.erase(held);
    log_(LogLevel::kInfo, device + ": id " + IdText(id) + ' ' +
                              std::string(StateName(static_cast<std::int8_t>(outcome.state))) + ": " +
                              outcome.text);
  }
  server_.Report(device, id, outcome, target->channel->summary().datum_epoch, writes);
}

void Operations::Abandon(MonoNs now) {
  for (Target& target : targets_) {
    const std::vector<Held> held = target.held;
    for (const Held& candidate : held) {
      Cancel(target, candidate.id, command_status_t::REASON_STOPPING,
             "the driver stopped before it began: send it again later", now);
    }
  }
}

void Operations::CountWrites() {
  for (const Target& target : targets_) {
    for (const Held& held : target.held) server_.CountWrites(target.config->name, held.id, WritesOf(target, held));
  }
}

bool Operations::Busy() const {
  return std::any_of(targets_.begin(), targets_.end(), [](const Target& target) { return !target.held.empty(); });
}

Operations::Target* Operations::Find(const std::string& device) {
  const auto found = std::find_if(targets_.begin(), targets_.end(),
                                  [&](const Target& target) { return target.config->name == device; });
  return found == targets_.end() ? nullptr : &*found;
}

}  // namespace axlecast
