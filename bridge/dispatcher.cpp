#include "bridge/dispatcher.h"

#include <algorithm>
#include <axlecast/driver_command_t.hpp>
#include <axlecast/driver_order_t.hpp>
#include <utility>

#include "bridge/finding.h"
#include "drivers/runtime/command/body_digest.h"
#include "drivers/runtime/command/capped_text.h"
#include "drivers/runtime/command/command_words.h"
#include "drivers/runtime/command/order_ledger.h"
#include "drivers/runtime/core/decode_message.h"

namespace axlecast {
namespace {

using S = command_status_t;

constexpr std::size_t kTurnedAway = 1'024;
constexpr std::string_view kDriverStatus = "DRIVER_STATUS/";

command_status_t StatusOf(const command_body_t& body, std::int64_t digest) {
  command_status_t status{};
  std::copy(std::begin(body.id), std::end(body.id), std::begin(status.id));
  status.body_digest = digest;
  status.device = CappedText(body.device, kNameBytes);
  status.operation = CappedText(body.operation, kNameBytes);
  status.epoch_after = -1;
  return status;
}

Task TaskOf(const command_body_t& body, const Admitted& admitted, command_status_t status, MonoNs now) {
  Task task;
  task.id = IdOf(body.id);
  task.device = body.device;
  task.operation = admitted.operation;
  task.arguments = body.arguments;
  task.expect_epoch = body.expect_epoch;
  task.begin_by = now + body.valid_ms * kMillisecond;
  task.status = std::move(status);
  return task;
}

}  // namespace

Dispatcher::Dispatcher(const MachineConfig& machine, std::int64_t boot_id, Journal& journal, MessageSink& sink,
                       Instant now)
    : machine_(machine),
      boot_id_(boot_id),
      journal_(journal),
      sink_(sink),
      watch_(boot_id, now.mono),
      epoch_(now.mono / kMicrosecond) {  // above every epoch of an earlier bridge on this host
  for (const BusConfig& config : machine.buses) {
    Bus& bus = buses_[config.name];
    bus.config = &config;
    bus.driver.ListenFrom(now.mono);
    for (const DeviceConfig& device : config.devices) {
      bus.lanes.try_emplace(device.name, bus.driver, static_cast<LaneOutput&>(*this));
      bus.urgent.try_emplace(device.name, bus.driver, static_cast<LaneOutput&>(*this));
    }
  }
}

void Dispatcher::OnCommand(Bytes message, Instant now) {
  const auto envelope = DecodeMessage<command_t>(message);
  const auto body = envelope ? DecodeMessage<command_body_t>(envelope->body) : std::nullopt;
  if (!body) {
    ++malformed_;
    return;
  }
  if (watch_.IsListening(now.mono)) return;  // clients repeat
  if (body->mode != command_body_t::MODE_QUERY) return Execute(*envelope, *body, now);
  const auto known = journal_.Find(IdOf(body->id));
  Publish(known ? *known : StatusOf(*body, 0), now);
}

void Dispatcher::Execute(const command_t& envelope, const command_body_t& body, Instant now) {
  command_status_t status = StatusOf(body, BodyDigest(envelope.body));
  const auto known = journal_.Find(IdOf(body.id));
  const bool cancels = body.mode == command_body_t::MODE_CANCEL;
  if (known && !cancels) {
    if (known->body_digest == status.body_digest) return Publish(*known, now);
    return Refuse(status, {S::REASON_ID_REUSED, "this id was used with another body: take a new random id"}, now);
  }
  const auto admission = Admit(machine_, boot_id_, envelope, body);
  if (const auto* refusal = std::get_if<Refusal>(&admission)) return Refuse(status, *refusal, now);
  const Admitted& admitted = std::get<Admitted>(admission);
  if (cancels) return Cancel(body, admitted, now);
  status.is_unsigned = 1;  // what was admitted was not verified
  Accept(body, admitted, std::move(status), now);
}

void Dispatcher::Cancel(const command_body_t& body, const Admitted& admitted, Instant now) {
  Bus& bus = buses_.at(admitted.bus->name);
  auto known = journal_.Find(IdOf(body.id));
  if (!known) return Publish(StatusOf(body, 0), now);
  DeviceLane& lane = admitted.operation->urgent ? bus.urgent.at(body.device) : bus.lanes.at(body.device);
  if (!IsFinalState(known->state) && lane.Cancel(IdOf(body.id), now)) {
    known = journal_.Find(IdOf(body.id));
  }
  if (known && !IsFinalState(known->state)) known->text = "the driver was asked to give it up if it has not begun";
  if (known) Publish(*known, now);
}

std::optional<Refusal> Dispatcher::Busy(const Bus& bus, const DeviceLane& lane, MonoNs now) const {
  if (const auto other = watch_.Other(now)) {
    return Refusal{S::REASON_FENCED, "another bridge serves this command port: stop one of the two"};
  }
  if (bus.driver.IsAbsent(now)) {
    return Refusal{S::REASON_DRIVER_ABSENT, "the driver of " + bus.config->name +
                                                " is not running: start it (axlecast "
                                                "driver " +
                                                bus.config->name + ", or systemctl)"};
  }
  if (lane.IsFull()) {
    return Refusal{S::REASON_QUEUE_FULL, std::to_string(DeviceLane::kMaxWaiting) +
                                             " commands wait for this device already: send it again later"};
  }
  return std::nullopt;
}

void Dispatcher::Accept(const command_body_t& body, const Admitted& admitted, command_status_t status,
                        Instant now) {
  Bus& bus = buses_.at(admitted.bus->name);
  const bool urgent = admitted.operation->urgent;
  DeviceLane& lane = urgent ? bus.urgent.at(body.device) : bus.lanes.at(body.device);
  const auto busy = Busy(bus, lane, now.mono);
  status.state = busy ? S::STATE_REJECTED : S::STATE_ACCEPTED;
  const MonoNs keep_until = now.mono + body.valid_ms * kMillisecond + Journal::kKeep;
  const bool away = std::find(turned_away_.begin(), turned_away_.end(), IdOf(body.id)) != turned_away_.end();
  const bool noted = !away && journal_.Accepted(status, now.mono, keep_until);
  // What is urgent does not wait for room in a journal.
  if (!noted && (away || !urgent)) return TurnAway(status, now);
  if (busy) return Refuse(status, *busy, now);
  Publish(status, now);
  lane.Push(TaskOf(body, admitted, std::move(status), now.mono));
  lane.Tick(now);
}

// What was refused for want of room stays refused when there is room again.
void Dispatcher::TurnAway(const command_status_t& status, Instant now) {
  turned_away_.push_back(IdOf(status.id));
  if (turned_away_.size() > kTurnedAway) turned_away_.pop_front();
  Refuse(status, {S::REASON_JOURNAL, "the journal is full: nothing is done that could not be remembered"}, now);
}

void Dispatcher::Refuse(command_status_t status, const Refusal& refusal, Instant now) {
  status.state = S::STATE_REJECTED;
  status.is_final = 1;
  status.reason_code = refusal.reason;
  status.text = CappedText(refusal.text, kTextBytes);
  status.finished_utime = now.utime;
  const auto known = journal_.Find(IdOf(status.id));
  if (known && known->body_digest == status.body_digest) journal_.Outcome(status);
  Publish(status, now);
}

void Dispatcher::OnDriverStatus(const std::string& channel, Bytes message, Instant now) {
  if (!channel.starts_with(kDriverStatus)) return;
  const auto found = buses_.find(channel.substr(kDriverStatus.size()));
  if (found == buses_.end()) return;
  const auto status = DecodeMessage<driver_status_t>(message);
  if (!status || status->bus != found->first) {
    ++malformed_;
    return;
  }
  Bus& bus = found->second;
  if (!bus.driver.On(*status, now.mono)) return;
  if (status->kind == driver_status_t::KIND_HELLO) OnHello(bus, *status);
  for (auto* lanes : {&bus.urgent, &bus.lanes}) {
    for (auto& [device, lane] : *lanes) {
      if (status->kind == driver_status_t::KIND_STATUS) lane.OnStatus(*status, now);
      lane.Tick(now);
    }
  }
}

void Dispatcher::OnHello(Bus& bus, const driver_status_t& status) {
  for (const driver_device_t& device : status.devices) {
    const auto lane = bus.lanes.find(device.device);
    if (lane == bus.lanes.end()) continue;
    if (!references_.OnHello(device.device, status.boot_id, device.reference_lost != 0)) continue;
    if (lane->second.Holds(Task::Purpose::kReferenceLost)) continue;
    Task task;
    task.purpose = Task::Purpose::kReferenceLost;
    task.device = device.device;
    task.operation = FindOperation(*bus.config->family, "mark_reference_lost");
    lane->second.PushFirst(std::move(task));
  }
}

void Dispatcher::Tick(Instant now) {
  if (auto question = watch_.Probe(now.mono)) {
    question->utime = now.utime;
    question->mono_ns = now.mono;
    question->boot_id = boot_id_;
    question->seq = seq_["COMMAND"]++;
    axlecast::Publish(sink_, "COMMAND", *question);
  }
  for (auto& [name, bus] : buses_) {
    for (auto& [device, lane] : bus.urgent) lane.Tick(now);
    for (auto& [device, lane] : bus.lanes) lane.Tick(now);
  }
}

std::int64_t Dispatcher::Send(const Task& task, std::int8_t kind, std::int32_t valid_ms, Instant now) {
  driver_order_t order{};
  order.driver_boot_id = task.status.driver_boot_id;
  order.bridge_boot_id = boot_id_;
  order.bridge_epoch = ++epoch_;
  const CommandId& id = task.asks_driver ? task.about : task.id;
  std::copy(id.begin(), id.end(), std::begin(order.id));
  order.kind = kind;
  order.valid_ms = valid_ms;
  order.device = task.device;
  order.expect_epoch = task.expect_epoch;
  if (task.operation != nullptr) order.operation = task.operation->name;
  if (kind == driver_order_t::KIND_EXECUTE) order.arguments = task.arguments;
  order.n_arguments = static_cast<std::int8_t>(order.arguments.size());

  driver_command_t envelope{};
  envelope.utime = now.utime;
  envelope.mono_ns = now.mono;
  envelope.boot_id = boot_id_;
  const std::string channel = "DRIVER_COMMAND/" + machine_.BusOf(task.device)->name;
  envelope.seq = seq_[channel]++;
  envelope.order.resize(static_cast<std::size_t>(order.getEncodedSize()));
  order.encode(envelope.order.data(), 0, static_cast<int>(envelope.order.size()));
  envelope.order_size = static_cast<std::int16_t>(envelope.order.size());
  axlecast::Publish(sink_, channel, envelope);
  return order.bridge_epoch;
}

CommandId Dispatcher::NewId() {
  CommandId id;
  const std::int64_t number = ++own_ids_;
  for (std::size_t i = 0; i < 8; ++i) {
    id[i] = static_cast<std::uint8_t>(boot_id_ >> (8 * i));
    id[8 + i] = static_cast<std::uint8_t>(number >> (8 * i));
  }
  return id;
}

void Dispatcher::OnStep(Task& task, Instant now) {
  if (task.purpose != Task::Purpose::kCommand) return;
  journal_.Step(task.status);
  Publish(task.status, now);
}

void Dispatcher::OnEnd(Task task, Instant now) {
  if (task.purpose == Task::Purpose::kCommand) return EndCommand(std::move(task), now);
  if (task.purpose == Task::Purpose::kFinding) EndFinding(task, now);
}

void Dispatcher::EndCommand(Task task, Instant now) {
  command_status_t& status = task.status;
  status.is_final = 1;
  if (status.state == S::STATE_INDETERMINATE) {
    Bus& bus = buses_.at(machine_.BusOf(task.device)->name);
    if (auto finding = FindingTask(task, *bus.config->family, now.mono + kFindWithin)) {
      bus.lanes.at(task.device).PushFirst(std::move(*finding));
    } else {
      status.finding = S::FINDING_CANNOT_TELL;
    }
  }
  journal_.Outcome(status);
  Publish(status, now);
}

void Dispatcher::EndFinding(const Task& task, Instant now) {
  auto outcome = journal_.Find(task.about);
  if (!outcome) return;
  AddFinding(task, *outcome);
  journal_.Outcome(*outcome);
  Publish(*outcome, now);
}

void Dispatcher::Publish(command_status_t status, Instant now) {
  status.utime = now.utime;
  status.mono_ns = now.mono;
  status.boot_id = boot_id_;
  status.seq = seq_["COMMAND_STATUS"]++;
  axlecast::Publish(sink_, "COMMAND_STATUS", status);
}

}  // namespace axlecast
