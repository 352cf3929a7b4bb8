#include "bridge/dispatch/dispatcher.h"

#include <algorithm>
#include <axlecast/driver_order_t.hpp>
#include <utility>

#include "bridge/dispatch/command_port.h"
#include "bridge/dispatch/outcome_check.h"
#include "core/base/text.h"
#include "core/command/command_id.h"
#include "core/messages/enum_names.h"
#include "core/messages/message.h"

namespace axlecast {
namespace {

using S = command_status_t;

constexpr std::string_view kDriverStatus = "DRIVER_STATUS/";
constexpr std::int64_t kEpochs = std::int64_t{1} << 32;  // reserved at each start: never used up

}  // namespace

Dispatcher::Dispatcher(const MachineConfig& machine, std::int64_t boot_id, BridgePorts ports, Timestamp now)
    : machine_(machine),
      ports_(std::move(ports)),
      now_(now),
      queue_(*ports_.journal),
      devices_(queue_),
      port_(*ports_.commands, boot_id, ports_.key, now.utime),
      authority_(machine.bridge),
      watch_(boot_id, now.mono),
      alarms_(*ports_.data, boot_id),
      axes_(devices_, [this](const AxisEvent& event) { ports_.log(event.device + ": " + event.text); }),
      marks_(devices_) {
  devices_.AdvanceTime(now.mono);
  for (const BusConfig& config : machine.buses) {
    Bus& bus = buses_[config.name];
    bus.config = &config;
    bus.driver.ListenFrom(now.mono);
    bus.driver.Expect(bus.config->devices);
    for (const DeviceConfig& device : config.devices) {
      bus.lanes.try_emplace(device.name, bus.driver, static_cast<DeviceQueueListener&>(*this));
      bus.urgent.try_emplace(device.name, bus.driver, static_cast<DeviceQueueListener&>(*this));
    }
  }
  LoadJournal();
  Settle();
}

// Continues what the journal's thread has finished in the meantime. Every public function ends with this call.
void Dispatcher::Settle() {
  queue_.Settle();
  TellOverdue();
}

// Reads what an earlier bridge left, and reserves epochs above those of every bridge before.
void Dispatcher::LoadJournal() {
  if (loading_ || (loaded_ && (reserved_ || !queue_.Problem(now_.mono).empty()))) return;
  loading_ = true;
  std::vector<std::string> names;
  for (const BusConfig& bus : machine_.buses) {
    for (const DeviceConfig& device : bus.devices) names.push_back(device.name);
  }
  const auto snapshot = std::make_shared<Snapshot>();
  queue_.Ask(
      [snapshot, names = std::move(names), utime = now_.utime](DurableStore& store) {
        snapshot->first_epoch = store.ReserveEpochs(utime, kEpochs);
        if (!store.readable()) return false;
        for (const std::string& name : names) snapshot->devices.Load(name, store);
        snapshot->open = store.Open();
        return true;
      },
      [this, snapshot](bool read) {
        loading_ = false;
        reserved_ = reserved_ || snapshot->first_epoch != 0;
        port_.Heard(snapshot->first_epoch);
        if (read && !loaded_) TakeUp(std::move(*snapshot));
      },
      now_.mono);
}

void Dispatcher::TakeUp(Snapshot snapshot) {
  loaded_ = true;
  devices_.Load(std::move(snapshot.devices));
  for (const OpenCommand& command : snapshot.open) {
    if (memory_.Find(IdOf(command.record.status.id)) == nullptr) Resume(command, now_);
  }
}

void Dispatcher::Settle(Timestamp now) {
  now_ = now;
  devices_.AdvanceTime(now.mono);
  Settle();
}

// What is due in the journal's thread: one at a time.
void Dispatcher::TickJournal() {
  if (ticking_) return;
  ticking_ = true;
  queue_.Ask(
      [now = now_, positions = devices_.TakePositions()](DurableStore& store) {
        for (const auto& [device, position] : positions) store.KeepPosition(device, position);
        store.Tick(now);
        return true;
      },
      [this](bool /*written*/) { ticking_ = false; }, now_.mono);
}

std::string Dispatcher::JournalProblem(MonoNs now) const {
  std::string problem = queue_.Problem(now);
  if (problem.empty() && !loaded_) problem = "it has not been read yet: send this again in a second";
  return problem;
}

// A command that an earlier bridge left: one that was never sent is refused; of one that was, its driver is asked.
void Dispatcher::Resume(const OpenCommand& command, Timestamp now) {
  PendingCommand task = RecoveredCommand(machine_, command);
  memory_.Begin(task.status, now.mono);
  memory_.Tell(task.status);
  if (task.operation == nullptr || task.status.driver_boot_id == 0) {
    GiveUp(task.status, now);
    return EndCommand(std::move(task), now);
  }
  static_cast<void>(axes_.Substitute(*machine_.BusOf(task.device)->family, task));
  task.sent_epoch = port_.epoch() + 1;  // of the first order that its driver can have of this bridge
  task.reserved_writes = task.WritesAtMost();
  if (task.status.state == S::STATE_INDETERMINATE) {
    BeginFinding(task, task.status, now);
    if (task.status.finding != S::FINDING_NONE) Conclude(task.status, now);
    return;
  }
  DeviceQueue& lane = LaneOf(buses_.at(machine_.BusOf(task.device)->name), task.device, task.operation);
  lane.Adopt(std::move(task));
}

void Dispatcher::OnCommandStatus(Bytes message, Timestamp now) {
  now_ = now;
  devices_.AdvanceTime(now.mono);
  const auto status = DecodeMessage<command_status_t>(message);
  if (!status || status->boot_id == port_.boot_id()) return;
  const auto& key = machine_.bridge.bridge.public_key;
  if (key && !VerifyMessage(*key, Domain::kStatus, *status)) {
    return OnForeign("a status that no bridge of this machine has signed", now);
  }
  watch_.OnOther(status->boot_id, now.mono);
}

void Dispatcher::OnDriverStatus(const std::string& channel, Bytes message, Timestamp now) {
  now_ = now;
  devices_.AdvanceTime(now.mono);
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
  if (status->kind == driver_status_t::KIND_HELLO && loaded_) OnHello(bus, *status, now);
  if (status->kind == driver_status_t::KIND_ACKNOWLEDGED && loaded_) marks_.OnAcknowledged(*status);
  for (auto* lanes : {&bus.urgent, &bus.lanes}) {
    for (auto& [device, lane] : *lanes) {
      if (status->kind == driver_status_t::KIND_STATUS) lane.OnStatus(*status, now);
      lane.Tick(now);
    }
  }
  Settle();
}

void Dispatcher::OnHello(Bus& bus, const driver_status_t& status, Timestamp now) {
  for (const driver_device_t& said : status.devices) {
    const auto lane = bus.lanes.find(said.device);
    if (lane == bus.lanes.end()) continue;
    auto order = axes_.OnHello(*machine_.FindDevice(said.device), said, status.boot_id, lane->second.IsIdle(), now);
    if (!order) order = marks_.OnHello(said.device, status.boot_id, now);
    if (!order || lane->second.Holds(PendingCommand::Purpose::kRestore)) continue;
    PendingCommand task;
    task.purpose = PendingCommand::Purpose::kRestore;
    task.device = said.device;
    task.operation = FindOperation(*bus.config->family, order->operation);
    task.arguments = std::move(order->arguments);
    lane->second.PushFirst(std::move(task));
  }
}

void Dispatcher::Tick(Timestamp now) {
  now_ = now;
  devices_.AdvanceTime(now.mono);
  TickJournal();
  Settle();
  LoadJournal();
  if (const auto question = watch_.Probe(now.mono)) port_.Ask(*question, now);
  for (auto& [name, bus] : buses_) {
    for (auto& [device, lane] : bus.urgent) lane.Tick(now);
    for (auto& [device, lane] : bus.lanes) lane.Tick(now);
  }
  Settle();
  alarms_.Tick({.foreign_commands = foreign_.Recent(now.mono),
                .journal_fails = !JournalProblem(now.mono).empty(),
                .unsigned_allowed = machine_.bridge.allow_unsigned,
                .encoder_exchanged = axes_.AnyExchanged(),
                .place_doubtful = axes_.AnyDoubtful(),
                .key_missing = machine_.bridge.bridge.public_key && ports_.key == nullptr,
                .other_bridge = watch_.Other(now.mono).has_value()},
               now);
}

std::int64_t Dispatcher::Send(const PendingCommand& task, std::int8_t kind, std::int32_t valid_ms, Timestamp now) {
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

std::optional<Refusal> Dispatcher::BeforeRoute(PendingCommand& task, Timestamp now) {
  task.noting = PendingCommand::Noting::kReady;
  if (task.purpose != PendingCommand::Purpose::kCommand) return std::nullopt;
  const bool brief = memory_.IsBrief(task.id);
  if (!brief) {
    if (auto refusal = NoRoom(*task.operation, now.mono); refusal && refusal->reason == S::REASON_JOURNAL) {
      return refusal;
    }
  }
  if (auto refusal = axes_.BeforeRoute(*machine_.FindDevice(task.device), task, now)) return refusal;
  if (brief || (task.operation->urgent && queue_.IsFull())) return std::nullopt;
  const bool waits = !task.operation->urgent || !queue_.IsSlow(now.mono);
  if (waits) task.noting = PendingCommand::Noting::kRouted;
  DeviceQueue& lane = LaneOf(buses_.at(machine_.BusOf(task.device)->name), task.device, task.operation);
  queue_.Give([status = task.status, epoch = port_.epoch(),
               now](DurableStore& store) { return store.Routed(status, epoch, now); },
              [this, id = task.id, &lane](bool written) {
                lane.OnNoted(id, PendingCommand::Noting::kRouted, written, NotNoted(now_.mono), now_);
                lane.Tick(now_);
              },
              now.mono);
  return std::nullopt;
}

std::optional<Refusal> Dispatcher::JournalTooSlow(const PendingCommand& task, Timestamp now) {
  if (now.mono - task.noting_since <= JournalQueue::kStalled) return std::nullopt;
  return NotNoted(now.mono);
}

void Dispatcher::OnStep(PendingCommand& task, Timestamp now) {
  if (task.purpose != PendingCommand::Purpose::kCommand) return;
  const command_status_t& status = task.status;
  memory_.Update(status);
  memory_.Tell(status);
  // Routed has noted the first step already.
  if (!memory_.IsBrief(task.id) && status.state != S::STATE_ROUTED && !queue_.IsHalfFull()) {
    queue_.Ask([status, now](DurableStore& store) { return store.Step(status, now), true; }, nullptr, now.mono);
  }
  port_.Tell(status, now);
}

void Dispatcher::OnEnd(PendingCommand task, Timestamp now) {
  if (task.purpose == PendingCommand::Purpose::kFinding) return EndFinding(task, now);
  if (task.purpose == PendingCommand::Purpose::kCommand) return EndCommand(std::move(task), now);
  axes_.OnOutcome(*machine_.FindDevice(task.device), task, now);
  marks_.OnOutcome(task);
}

void Dispatcher::EndCommand(PendingCommand task, Timestamp now) {
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
  Conclude(status, now);
}

// Publishes an outcome or its finding after the journal has written it, or after the journal failed or stalled.
void Dispatcher::Conclude(const command_status_t& status, Timestamp now) {
  memory_.Update(status);
  if (memory_.IsBrief(IdOf(status.id))) return port_.Tell(status, now);
  auto outcome = std::make_shared<Untold>(Untold{status, now.mono});
  if (queue_.IsOverfull()) return TellOutcome(*outcome);
  if (queue_.IsFull() || queue_.IsStalled(now.mono)) TellOutcome(*outcome);
  if (!outcome->told) untold_.push_back(outcome);
  queue_.Ask([status, now](DurableStore& store) { return store.Outcome(status, now), true; },
             [this, outcome](bool /*written*/) {
               TellOutcome(*outcome);
               untold_.remove(outcome);
             },
             now.mono);
}

void Dispatcher::TellOutcome(Untold& outcome) {
  if (std::exchange(outcome.told, true)) return;
  memory_.Tell(outcome.status);
  port_.Tell(outcome.status, now_);
}

// Publishes the outcomes whose journal entries have waited longer than JournalQueue::kStalled.
void Dispatcher::TellOverdue() {
  for (const auto& outcome : untold_) {
    if (now_.mono - outcome->since > JournalQueue::kStalled) TellOutcome(*outcome);
  }
  std::erase_if(untold_, [](const auto& outcome) { return outcome->told; });
  for (const auto& lookup : lookups_) {
    if (lookup->answered || now_.mono - lookup->since <= JournalQueue::kSlow) continue;
    lookup->answered = true;
    lookup->answer(std::nullopt, false);
  }
}

void Dispatcher::BeginFinding(const PendingCommand& task, command_status_t& status, Timestamp now) {
  Bus& bus = buses_.at(machine_.BusOf(task.device)->name);
  const bool gone = status.reason_code != S::REASON_DRIVER_SILENT;
  if (gone && IsOfRuntime(*bus.config->family, *task.operation)) {
    // It would have changed that driver alone, which is no more.
    status.finding = S::FINDING_NO_EFFECT_SEEN;
    return;
  }
  if (auto finding = OutcomeCheckFor(task, *bus.config->family, now.mono + kFindWithin)) {
    bus.lanes.at(task.device).PushFirst(std::move(*finding));
  } else {
    status.finding = S::FINDING_CANNOT_TELL;
  }
}

void Dispatcher::EndFinding(const PendingCommand& task, Timestamp now) {
  if (auto again = NextLook(task, now.mono)) {
    return buses_.at(machine_.BusOf(task.device)->name).lanes.at(task.device).PushFirst(std::move(*again));
  }
  const KnownCommand* const known = memory_.Find(task.about);
  if (known == nullptr) return;
  command_status_t outcome = known->latest;
  AddCheckedOutcome(task, outcome);
  Conclude(outcome, now);
}

DeviceQueue& Dispatcher::LaneOf(Bus& bus, const std::string& device, const OperationSpec* operation) {
  return operation->urgent ? bus.urgent.at(device) : bus.lanes.at(device);
}

}  // namespace axlecast
