#include "drivers/runtime/command/operations.h"

#include <algorithm>
#include <axlecast/command_status_t.hpp>
#include <axlecast/device_info_t.hpp>

#include "core/command/command_id.h"
#include "core/command/operation_check.h"
#include "core/device/operation.h"
#include "core/messages/enum_names.h"
#include "drivers/kit/refusal.h"
#include "drivers/runtime/command/axis_commands.h"

namespace axlecast {
namespace {

Outcome Refused(std::int32_t reason, std::string text) {
  return {.state = CommandState::kRejected, .reason = reason, .text = std::move(text), .changes = {}};
}

// "eeprom_write address=72 data=A1"
std::string OrderText(const DriverCommand& order) {
  std::string text = order.operation;
  for (const auto& [key, value] : order.arguments) text += ' ' + key + '=' + value;
  return text;
}

}  // namespace

std::int32_t Operations::WritesOf(const Target& target, const Held& held) {
  return static_cast<std::int32_t>(target.channel->nv_writes() - held.writes_before);
}

bool Operations::Holds(const Target& target, const CommandId& id) {
  return std::any_of(target.held.begin(), target.held.end(), [&](const Held& held) { return held.id == id; });
}

void Operations::Add(const DeviceConfig& config, DevicePublisher& channel, Device& device) {
  targets_.push_back({.config = &config, .channel = &channel, .device = &device, .held = {}});
}

void Operations::Poll(MonoNs now) {
  while (const auto cancel = desk_.TakeCancel()) {
    if (Target* target = Find(cancel->device)) {
      Cancel(*target, cancel->order.id, command_status_t::REASON_CANCELLED, "cancelled before it began", now);
    }
  }
  while (const auto asked = desk_.TakePrepare()) {
    if (const Target* target = Find(asked->device)) {
      desk_.ReportPrepared(asked->order.id, Prepare(*target, asked->order, now),
                           target->channel->summary().datum_epoch);
    }
  }
  while (const auto taken = desk_.Take()) {
    if (Target* target = Find(taken->device)) Begin(*target, taken->order, now);
  }
}

void Operations::Begin(Target& target, const DriverCommand& order, MonoNs now) {
  target.held.push_back({order.id, target.channel->nv_writes()});
  log_(LogLevel::kDebug, target.config->name + ": " + order.operation + " begins, id " + IdText(order.id));
  const OperationSpec* operation = FindOperation(family_, order.operation);
  if (const auto refusal = Refuse(target, order, operation)) {
    return OnOutcome(target.config->name, order.id, *refusal);
  }
  if (!IsOfRuntime(family_, *operation)) return target.device->Begin(order, now);
  const auto apply = [&](const auto& own) {
    OnOutcome(target.config->name, order.id, own.refusal() ? *own.refusal() : own.Apply(*target.channel));
  };
  if (IsAboutAlarms(order.operation)) return apply(AlarmOrder(*target.channel, order, time_.Utime(now)));
  apply(DatumOrder(*target.channel, order, time_.Utime(now)));
}

Outcome Operations::Prepare(const Target& target, const DriverCommand& order, MonoNs now) const {
  const OperationSpec* operation = FindOperation(family_, order.operation);
  if (auto refusal = Refuse(target, order, operation)) return std::move(*refusal);
  if (IsOfRuntime(family_, *operation)) {
    const auto prepared = [](const auto& own) { return own.refusal() ? *own.refusal() : own.Prepared(); };
    if (IsAboutAlarms(order.operation)) return prepared(AlarmOrder(*target.channel, order, time_.Utime(now)));
    return prepared(DatumOrder(*target.channel, order, time_.Utime(now)));
  }
  if (const auto valid = target.device->Validate(order, now); !valid) return RefusedOutcome(valid.error());
  if (operation->needs_standstill) {
    if (auto refusal = RefusalInMotion(target.channel->MotionAt(now))) return std::move(*refusal);
  }
  Outcome outcome{.state = CommandState::kSucceeded, .text = "would do " + OrderText(order), .changes = {}};
  const std::int32_t writes = operation->writes != nullptr ? operation->writes(order.arguments) : 0;
  if (writes > 0) outcome.text += "; writes the device's memory at most " + std::to_string(writes) + " times";
  if (family_.has_position) {
    outcome.changes.push_back({"position", ValueText(target.channel->summary().value), ""});
  }
  return outcome;
}

std::optional<Outcome> Operations::Refuse(const Target& target, const DriverCommand& order,
                                          const OperationSpec* operation) const {
  if (operation == nullptr || operation->executed_by_bridge) {
    return Refused(command_status_t::REASON_UNKNOWN_OPERATION, OperationNames(family_));
  }
  const DevicePublisher::Summary now = target.channel->summary();
  if (order.expect_epoch >= 0 && order.expect_epoch != now.datum_epoch) {
    return Refused(command_status_t::REASON_EPOCH, "datum_epoch is " + std::to_string(now.datum_epoch) + ", not " +
                                                       std::to_string(order.expect_epoch) +
                                                       ": look at the position again, then repeat");
  }
  if (operation->needs_permit && target.config->permit_required &&
      !desk_.HasPermit(target.config->name, order.operation)) {
    return Refused(command_status_t::REASON_NO_PERMIT, desk_.WhyNoPermit(target.config->name, order.operation));
  }
  // What is urgent is tried on a device that seems to be gone, too.
  if (IsOfRuntime(family_, *operation) || operation->urgent) return std::nullopt;
  if (now.state == device_info_t::STATE_OFFLINE) {
    return Refused(command_status_t::REASON_DEVICE_OFFLINE,
                   "the device is offline: see DEVICE/" + target.config->name);
  }
  if (now.state == device_info_t::STATE_STARTING) {
    return Refused(command_status_t::REASON_DEVICE_OFFLINE, "the device is still starting: repeat it when online");
  }
  return std::nullopt;
}

void Operations::Cancel(Target& target, const CommandId& id, std::int32_t reason, const char* text, MonoNs now) {
  if (!Holds(target, id) || !target.device->Cancel(id, now)) return;
  OnOutcome(target.config->name, id,
            {.state = CommandState::kCancelled, .reason = reason, .text = text, .changes = {}});
}

void Operations::OnOutcome(const std::string& device, const CommandId& id, const Outcome& outcome) {
  Target* target = Find(device);
  if (target == nullptr) return;
  const auto held = std::find_if(target->held.begin(), target->held.end(),
                                 [&](const Held& candidate) { return candidate.id == id; });
  if (held == target->held.end()) return;
  const std::int32_t writes = WritesOf(*target, *held);
  if (outcome.IsFinal()) {
    target->held.erase(held);
    log_(LogLevel::kInfo, device + ": id " + IdText(id) + ' ' +
                              std::string(StateName(static_cast<std::int8_t>(outcome.state))) + ": " +
                              outcome.text);
  }
  desk_.Report(device, id, outcome, target->channel->summary().datum_epoch, writes);
}

void Operations::Abandon(MonoNs now) {
  for (Target& target : targets_) {
    const std::vector<Held> held = target.held;
    for (const Held& order : held) {
      Cancel(target, order.id, command_status_t::REASON_STOPPING,
             "the driver stopped before it began: send it again later", now);
    }
  }
}

void Operations::CountWrites() {
  for (const Target& target : targets_) {
    for (const Held& held : target.held) desk_.CountWrites(target.config->name, held.id, WritesOf(target, held));
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
