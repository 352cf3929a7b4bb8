#include "bridge/dispatcher.h"

#include <algorithm>
#include <axlecast/driver_order_t.hpp>
#include <utility>

#include "bridge/finding.h"
#include "bridge/resume.h"
#include "bridge/status.h"
#include "drivers/runtime/command/body_digest.h"
#include "drivers/runtime/command/capped_text.h"
#include "drivers/runtime/command/command_words.h"
#include "drivers/runtime/command/order_ledger.h"
#include "drivers/runtime/core/decode_message.h"

namespace axlecast {
namespace {

using S = command_status_t;

constexpr std::string_view kDriverStatus = "DRIVER_STATUS/";
constexpr std::int64_t kEpochs = std::int64_t{1} << 32;  // reserved at each start: never used up

bool IsBrief(const command_body_t& body, const OperationSpec& operation) {
  return body.mode == command_body_t::MODE_PREPARE || operation.reads_only;
}

// Epochs of this bridge, above those of every bridge before.
std::int64_t FirstEpoch(DurableStore& store, Instant now) {
  const std::int64_t reserved = store.ReserveEpochs(now.utime, kEpochs);
  return reserved != 0 ? reserved : now.utime;
}

}  // namespace

Dispatcher::Dispatcher(const MachineConfig& machine, std::int64_t boot_id, BridgePorts ports, Instant now)
    : machine_(machine),
      ports_(std::move(ports)),
      store_(*ports_.store),
      port_(*ports_.commands, boot_id, ports_.key, FirstEpoch(store_, now)),
      memory_(store_),
      authority_(machine.bridge),
      watch_(boot_id, now.mono),
      alarms_(*ports_.data, boot_id),
      axes_(store_, [this](const AxisEvent& event) { ports_.log(event.device + ": " + event.text); }),
      marks_(store_) {
  for (const BusConfig& config : machine.buses) {
    Bus& bus = buses_[config.name];
    bus.config = &config;
    bus.driver.ListenFrom(now.mono);
    for (const DeviceConfig& device : config.devices) {
      bus.lanes.try_emplace(device.name, bus.driver, static_cast<LaneOutput&>(*this));
      bus.urgent.try_emplace(device.name, bus.driver, static_cast<LaneOutput&>(*this));
    }
  }
  taken_up_ = store_.problem().empty();
  for (const OpenCommand& command : store_.Open()) Resume(command, now);
}

// A store that could not be opened at the start can be now.
void Dispatcher::TakeUpLate(Instant now) {
  if (taken_up_ || !store_.problem().empty()) return;
  taken_up_ = true;
  port_.Heard(FirstEpoch(store_, now));
  for (const OpenCommand& command : store_.Open()) Resume(command, now);
}

// A command that an earlier bridge left: one that was never sent is refused; of one that was, its driver is asked.
void Dispatcher::Resume(const OpenCommand& command, Instant now) {
  Task task = ResumedTask(machine_, command);
  if (task.operation == nullptr || task.status.driver_boot_id == 0) {
    GiveUp(task.status, now);
    return EndCommand(std::move(task), now);
  }
  static_cast<void>(axes_.Substitute(*machine_.BusOf(task.device)->family, task));
  task.sent_epoch = port_.epoch() + 1;  // of the first order that its driver can have of this bridge
  task.reserved_writes = task.WritesAtMost();
  if (task.status.state == S::STATE_INDETERMINATE) {
    BeginFinding(task, task.status, now);
    if (task.status.finding != S::FINDING_NONE) memory_.Outcome(task.status, now);
    return;
  }
  DeviceLane& lane = LaneOf(buses_.at(machine_.BusOf(task.device)->name), task.device, task.operation);
  lane.Adopt(std::move(task));
}

void Dispatcher::OnCommand(Bytes message, Instant now) {
  const auto envelope = DecodeMessage<command_t>(message);
  const auto body = envelope ? DecodeMessage<command_body_t>(envelope->body) : std::nullopt;
  if (!body) return OnForeign("a command that cannot be read", now);
  if (watch_.IsListening(now.mono)) return;  // clients repeat
  if (body->mode == command_body_t::MODE_QUERY) {
    const auto known = memory_.Find(IdOf(body->id));
    return port_.Tell(known ? *known : StatusOf(*body, 0), now);
  }
  command_status_t status = StatusOf(*body, BodyDigest(envelope->body));
  auto caller = authority_.Identify(*envelope, *body);
  if (const auto* refusal = std::get_if<Refusal>(&caller)) {
    OnForeign("a command for " + status.device + ": " + refusal->text, now);
    if (foreign_.MayAnswer(now.mono)) Refuse(std::move(status), *refusal, now);
    return;
  }
  Execute({*body, std::get<Caller>(std::move(caller)), {}, std::move(status)}, now);
}

void Dispatcher::Execute(Incoming incoming, Instant now) {
  const command_body_t& body = incoming.body;
  const auto known = memory_.Find(IdOf(body.id));
  const bool cancels = body.mode == command_body_t::MODE_CANCEL;
  if (known && !cancels) {
    if (known->body_digest == incoming.status.body_digest) return port_.Tell(*known, now);
    return Refuse(incoming.status,
                  {S::REASON_ID_REUSED, "this id was used with another body: take a new random id"}, now);
  }
  const auto admission = Admit(machine_, port_.boot_id(), authority_, incoming.caller, body, now.mono);
  if (const auto* refusal = std::get_if<Refusal>(&admission)) {
    if (refusal->reason == S::REASON_DENIED) ports_.log(incoming.caller.who + ": " + refusal->text);
    return cancels ? TellKnown(body, refusal->text, now) : Refuse(incoming.status, *refusal, now);
  }
  incoming.admitted = std::get<Admitted>(admission);
  return cancels ? Cancel(incoming, now) : Accept(std::move(incoming), now);
}

void Dispatcher::Cancel(const Incoming& incoming, Instant now) {
  const CommandId id = IdOf(incoming.body.id);
  Bus& bus = buses_.at(incoming.admitted.bus->name);
  DeviceLane& lane = LaneOf(bus, incoming.body.device, incoming.admitted.operation);
  const auto sender = lane.SenderOf(id);
  if (!sender) return TellKnown(incoming.body, "", now);
  if (!authority_.MayCancel(incoming.caller, *sender)) {
    return TellKnown(incoming.body, "only who gave it, or a maintainer, may cancel it", now);
  }
  lane.Cancel(id, now);
  TellKnown(incoming.body, "the driver was asked to give it up if it has not begun", now);
}

// How the command of a cancellation stands. `text` says what came of the latter, unless the command has ended.
void Dispatcher::TellKnown(const command_body_t& body, const std::string& text, Instant now) {
  auto known = memory_.Find(IdOf(body.id));
  if (known && !IsFinalState(known->state)) known->text = text;
  port_.Tell(known ? *known : StatusOf(body, 0), now);
}

std::optional<Refusal> Dispatcher::Busy(const Bus& bus, const DeviceLane& lane, MonoNs now) const {
  if (watch_.Other(now)) {
    return Refusal{S::REASON_FENCED, "another bridge serves this command port: stop one of the two"};
  }
  if (bus.driver.IsAbsent(now)) {
    return Refusal{S::REASON_DRIVER_ABSENT, "the driver of " + bus.config->name +
                                                " is not running: start it (axlecast driver " + bus.config->name +
                                                ", or systemctl)"};
  }
  if (lane.IsFull()) {
    return Refusal{S::REASON_QUEUE_FULL, std::to_string(DeviceLane::kMaxWaiting) +
                                             " commands wait for this device already: send it again later"};
  }
  return std::nullopt;
}

// The task that carries the command out; why there is none.
std::optional<Refusal> Dispatcher::MakeTask(const Incoming& incoming, Task& task, Instant now) {
  const command_body_t& body = incoming.body;
  task.id = IdOf(body.id);
  task.device = body.device;
  task.operation = incoming.admitted.operation;
  task.arguments = body.arguments;
  task.expect_epoch = body.expect_epoch;
  task.begin_by = incoming.admitted.begin_by;
  task.who = incoming.caller.who;
  task.reason = CappedText(body.reason, kReasonBytes);
  task.prepare = body.mode == command_body_t::MODE_PREPARE;
  task.status = incoming.status;
  if (body.mode == command_body_t::MODE_COMMIT) {
    const auto epoch = tokens_.Redeem(body, task.who, now.mono);
    if (const auto* refusal = std::get_if<Refusal>(&epoch)) return *refusal;
    if (task.expect_epoch < 0) task.expect_epoch = std::get<std::int32_t>(epoch);
  }
  return axes_.Substitute(*incoming.admitted.bus->family, task);
}

void Dispatcher::Accept(Incoming incoming, Instant now) {
  Bus& bus = buses_.at(incoming.admitted.bus->name);
  const OperationSpec& operation = *incoming.admitted.operation;
  DeviceLane& lane = LaneOf(bus, incoming.body.device, &operation);
  incoming.status.is_unsigned = incoming.caller.grant == nullptr ? 1 : 0;
  Task task;
  auto refusal = Busy(bus, lane, now.mono);
  if (!refusal) refusal = MakeTask(incoming, task, now);
  incoming.status.state = S::STATE_ACCEPTED;
  if (refusal) incoming.status = Refused(incoming.status, *refusal, now);
  // What is urgent does not wait for room in a journal.
  if (!memory_.Note(RecordOf(incoming, now), IsBrief(incoming.body, operation), now)) {
    if (!operation.urgent) refusal = NotNoted();
    if (refusal) incoming.status = Refused(incoming.status, *refusal, now);
    memory_.Keep(incoming.status);
  }
  port_.Tell(incoming.status, now);
  if (refusal) return;
  task.status = incoming.status;
  lane.Push(std::move(task));
  lane.Tick(now);
}

CommandRecord Dispatcher::RecordOf(const Incoming& incoming, Instant now) const {
  const command_body_t& body = incoming.body;
  const std::int64_t left_us = (incoming.admitted.begin_by - now.mono) / kMicrosecond;
  return {.status = incoming.status,
          .arguments = body.arguments,
          .reason = CappedText(body.reason, kReasonBytes),
          .who = incoming.caller.who,
          .key_id = incoming.caller.key_id,
          .bridge_boot_id = port_.boot_id(),
          .utime = now.utime,
          .begin_by_utime = now.utime + left_us};
}

Refusal Dispatcher::NotNoted() const {
  return {S::REASON_JOURNAL, "the journal cannot note it, so nothing is done: " + store_.problem()};
}

void Dispatcher::Refuse(command_status_t status, const Refusal& refusal, Instant now) {
  port_.Tell(Refused(std::move(status), refusal, now), now);
}

void Dispatcher::OnForeign(const std::string& what, Instant now) {
  if (!foreign_.Count(now.mono)) return;
  const std::string text = what + "; " + std::to_string(foreign_.count()) + " such messages so far";
  store_.Note({now.utime, "", "foreign", text});
  ports_.log("refused " + text);
}

void Dispatcher::OnCommandStatus(Bytes message, Instant now) {
  const auto status = DecodeMessage<command_status_t>(message);
  if (!status || status->boot_id == port_.boot_id()) return;
  const auto& key = machine_.bridge.bridge.public_key;
  if (key && !VerifyMessage(*key, Domain::kStatus, *status)) {
    return OnForeign("a status that no bridge of this machine has signed", now);
  }
  watch_.OnOther(status->boot_id, now.mono);
}

void Dispatcher::OnDriverStatus(const std::string& channel, Bytes message, Instant now) {
  if (!channel.starts_with(kDriverStatus)) return;
  const auto found = buses_.find(channel.substr(kDriverStatus.size()));
  if (found == buses_.end()) return;
  const auto status = DecodeMessage<driver_status_t>(message);
  const auto& key = machine_.bridge.drivers.public_key;
  if (!status || status->bus != found->first || (key && !VerifyMessage(*key, Domain::kDriver, *status))) {
    return OnForeign("a message on " + channel + " that no driver of this machine has signed", now);
  }
  Bus& bus = found->second;
  if (!bus.driver.On(*status, now.mono)) return;
  port_.Heard(status->bridge_epoch);
  if (status->kind == driver_status_t::KIND_HELLO) OnHello(bus, *status, now);
  if (status->kind == driver_status_t::KIND_ACKNOWLEDGED) marks_.OnAcknowledged(*status);
  for (auto* lanes : {&bus.urgent, &bus.lanes}) {
    for (auto& [device, lane] : *lanes) {
      if (status->kind == driver_status_t::KIND_STATUS) lane.OnStatus(*status, now);
      lane.Tick(now);
    }
  }
}

void Dispatcher::OnHello(Bus& bus, const driver_status_t& status, Instant now) {
  for (const driver_device_t& said : status.devices) {
    const auto lane = bus.lanes.find(said.device);
    if (lane == bus.lanes.end()) continue;
    auto order = axes_.OnHello(*machine_.FindDevice(said.device), said, status.boot_id, lane->second.IsIdle(), now);
    if (!order) order = marks_.OnHello(said.device, status.boot_id, now);
    if (!order || lane->second.Holds(Task::Purpose::kRestore)) continue;
    Task task;
    task.purpose = Task::Purpose::kRestore;
    task.device = said.device;
    task.operation = FindOperation(*bus.config->family, order->operation);
    task.arguments = std::move(order->arguments);
    lane->second.PushFirst(std::move(task));
  }
}

void Dispatcher::Tick(Instant now) {
  if (const auto question = watch_.Probe(now.mono)) port_.Ask(*question, now);
  for (auto& [name, bus] : buses_) {
    for (auto& [device, lane] : bus.urgent) lane.Tick(now);
    for (auto& [device, lane] : bus.lanes) lane.Tick(now);
  }
  store_.Tick(now);
  TakeUpLate(now);
  alarms_.Tick({.foreign_commands = foreign_.Recent(now.mono),
                .journal_fails = !store_.problem().empty(),
                .unsigned_allowed = machine_.bridge.allow_unsigned,
                .encoder_exchanged = axes_.AnyExchanged(),
                .place_doubtful = axes_.AnyDoubtful(),
                .key_missing = machine_.bridge.bridge.public_key && ports_.key == nullptr,
                .other_bridge = watch_.Other(now.mono).has_value()},
               now);
}

std::int64_t Dispatcher::Send(const Task& task, std::int8_t kind, std::int32_t valid_ms, Instant now) {
  driver_order_t order{};
  order.driver_boot_id = task.status.driver_boot_id;
  const CommandId& id = task.asks_driver ? task.about : task.id;
  std::copy(id.begin(), id.end(), std::begin(order.id));
  order.kind = kind;
  order.valid_ms = valid_ms;
  order.device = task.device;
  order.expect_epoch = task.expect_epoch;
  if (task.operation != nullptr) order.operation = task.operation->name;
  const bool carries = kind == driver_order_t::KIND_EXECUTE || kind == driver_order_t::KIND_PREPARE;
  if (carries) order.arguments = task.arguments;
  return port_.Give(machine_.BusOf(task.device)->name, std::move(order), now);
}

CommandId Dispatcher::NewId() {
  CommandId id;
  const std::int64_t number = ++own_ids_;
  for (std::size_t i = 0; i < 8; ++i) {
    id[i] = static_cast<std::uint8_t>(port_.boot_id() >> (8 * i));
    id[8 + i] = static_cast<std::uint8_t>(number >> (8 * i));
  }
  return id;
}

std::optional<Refusal> Dispatcher::BeforeRoute(Task& task, Instant now) {
  if (task.purpose != Task::Purpose::kCommand) return std::nullopt;
  if (auto refusal = axes_.BeforeRoute(*machine_.FindDevice(task.device), task, now)) return refusal;
  if (memory_.Routed(task.status, port_.epoch(), now)) return std::nullopt;
  if (!task.operation->urgent) return NotNoted();
  memory_.Keep(task.status);
  return std::nullopt;
}

void Dispatcher::OnStep(Task& task, Instant now) {
  if (task.purpose != Task::Purpose::kCommand) return;
  memory_.Step(task.status, now);
  port_.Tell(task.status, now);
}

void Dispatcher::OnEnd(Task task, Instant now) {
  if (task.purpose == Task::Purpose::kFinding) return EndFinding(task, now);
  if (task.purpose == Task::Purpose::kCommand) return EndCommand(std::move(task), now);
  axes_.OnOutcome(*machine_.FindDevice(task.device), task, now);
  marks_.OnOutcome(task);
}

void Dispatcher::EndCommand(Task task, Instant now) {
  if (const DeviceConfig* device = machine_.FindDevice(task.device)) axes_.OnOutcome(*device, task, now);
  marks_.OnOutcome(task);
  command_status_t& status = task.status;
  status.is_final = 1;
  if (task.prepare && status.state == S::STATE_SUCCEEDED) {
    const Token token = ports_.random();
    std::copy(token.begin(), token.end(), std::begin(status.token));
    const bool substituted = task.operation->name != status.operation;
    tokens_.Issue(token,
                  {.who = task.who,
                   .device = task.device,
                   .operation = status.operation,
                   .arguments = substituted ? std::vector<argument_t>{} : task.arguments,
                   .epoch = status.epoch_after},
                  now.mono);
  }
  if (status.state == S::STATE_INDETERMINATE && status.finding == S::FINDING_NONE) BeginFinding(task, status, now);
  memory_.Outcome(status, now);
  port_.Tell(status, now);
}

void Dispatcher::BeginFinding(const Task& task, command_status_t& status, Instant now) {
  Bus& bus = buses_.at(machine_.BusOf(task.device)->name);
  const bool gone = status.reason_code != S::REASON_DRIVER_SILENT;
  if (gone && IsOfRuntime(*bus.config->family, *task.operation)) {
    // It would have changed that driver alone, which is no more.
    status.finding = S::FINDING_NO_EFFECT_SEEN;
    return;
  }
  if (auto finding = FindingTask(task, *bus.config->family, now.mono + kFindWithin)) {
    bus.lanes.at(task.device).PushFirst(std::move(*finding));
  } else {
    status.finding = S::FINDING_CANNOT_TELL;
  }
}

void Dispatcher::EndFinding(const Task& task, Instant now) {
  auto outcome = memory_.Find(task.about);
  if (!outcome) return;
  AddFinding(task, *outcome);
  memory_.Outcome(*outcome, now);
  port_.Tell(*outcome, now);
}

DeviceLane& Dispatcher::LaneOf(Bus& bus, const std::string& device, const OperationSpec* operation) {
  return operation->urgent ? bus.urgent.at(device) : bus.lanes.at(device);
}

}  // namespace axlecast
