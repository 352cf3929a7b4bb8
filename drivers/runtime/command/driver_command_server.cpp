#include "drivers/runtime/command/driver_command_server.h"

#include <algorithm>
#include <axlecast/command_status_t.hpp>
#include <axlecast/driver_command_t.hpp>
#include <axlecast/driver_status_t.hpp>
#include <utility>

#include "core/base/text.h"
#include "core/command/commands.h"
#include "core/messages/enum_names.h"

namespace axlecast {
namespace {

constexpr MonoNs kProgressPeriod = 50 * kMillisecond;
constexpr std::int32_t kMaxValidMs = 3'600'000;

DriverCommand CommandOf(const driver_order_t& message, MonoNs now) {
  DriverCommand command;
  command.id = IdOf(message.id);
  command.operation = message.operation;
  for (const argument_t& argument : message.arguments) command.arguments.emplace_back(argument.key, argument.value);
  command.begin_by = now + message.valid_ms * kMillisecond;
  command.expect_epoch = message.expect_epoch;
  return command;
}

// Returns a status that is not about a command.
driver_status_t StatusOfKind(std::int8_t kind) {
  driver_status_t status{};
  status.kind = kind;
  status.epoch_after = -1;
  return status;
}

bool IsUrgent(const Family& family, const std::string& operation) {
  const OperationSpec* spec = FindOperation(family, operation);
  return spec != nullptr && spec->urgent;
}

}  // namespace

void DriverCommandServer::Answer(const driver_order_t& order, std::int8_t state, std::int32_t reason,
                                 const char* text) {
  driver_status_t status = StatusOf(order);
  status.state = state;
  status.reason_code = reason;
  status.text = text;
  statuses_.Send(status);
}

Result<> DriverCommandServer::Check(const driver_order_t& order) {
  using Reason = command_status_t;
  if (stopping_) return Failure("the driver is stopping: send it again later", Reason::REASON_STOPPING);
  const CommandQueues::Queue* queue = queues_.Find(order.device, IsUrgent(family_, order.operation));
  if (queue == nullptr) {
    return Failure("no such device on " + bus_name_ + "; it has:" + queues_.Devices(),
                   Reason::REASON_UNKNOWN_DEVICE);
  }
  const OperationSpec* operation = FindOperation(family_, order.operation);
  if (operation == nullptr) {
    return Failure("no such operation; " + OperationNames(family_), Reason::REASON_UNKNOWN_OPERATION);
  }
  if (operation->executed_by_bridge) {
    return Failure("the bridge executes this operation, not a driver: send it to the bridge",
                   Reason::REASON_UNKNOWN_OPERATION);
  }
  if (const auto checked = CheckArguments(*operation, order.arguments); !checked) return Failure(checked.error());
  if (order.valid_ms < 1 || order.valid_ms > kMaxValidMs) {
    return Failure("valid_ms is " + std::to_string(order.valid_ms) + ", outside 1..3600000",
                   Reason::REASON_MALFORMED);
  }
  const bool prepare = order.kind == driver_order_t::KIND_PREPARE;
  if ((prepare ? to_prepare_.size() : queue->waiting.size()) >= kMaxWaiting) {
    return Failure("16 commands wait for this device: send it again later", Reason::REASON_QUEUE_FULL);
  }
  return {};
}

void DriverCommandServer::Begin(const driver_order_t& order) {
  const Result<> checked = Check(order);
  CommandStatusTable::Entry& entry = statuses_.Add(order);
  if (!checked) {
    return statuses_.End(entry, command_status_t::STATE_REJECTED, checked.error().reason, checked.error().text);
  }
  entry.command = CommandOf(order, statuses_.Now());
  entry.status.state = command_status_t::STATE_ROUTED;
  if (entry.prepare) {
    to_prepare_.push_back(entry.command.id);
    prepares_ = true;
  } else {
    queues_.Push(*queues_.Find(order.device, IsUrgent(family_, order.operation)), entry.command.id);
  }
  statuses_.Publish(entry);
}

void DriverCommandServer::Cancel(CommandStatusTable::Entry& entry) {
  const CommandId id = IdOf(entry.status.id);
  if (IsFinalState(entry.status.state)) return statuses_.Publish(entry);
  CommandQueues::Queue& queue = *queues_.Find(entry.status.device, IsUrgent(family_, entry.status.operation));
  if (entry.prepare ? std::erase(to_prepare_, id) > 0 : queues_.Drop(queue, id)) {
    return statuses_.End(entry, command_status_t::STATE_CANCELLED, command_status_t::REASON_CANCELLED,
                         "cancelled before it began");
  }
  if (queue.held == id) {
    queue.cancel_requested = true;
    cancels_ = true;
  }
  statuses_.Publish(entry);
}

bool DriverCommandServer::IsOver(const CommandId& id, MonoNs now) {
  CommandStatusTable::Entry& entry = statuses_.At(id);
  if (now <= entry.command.begin_by) return false;
  statuses_.End(entry, command_status_t::STATE_EXPIRED, command_status_t::REASON_DEADLINE,
                "its time ran out while it waited for the device");
  return true;
}

void DriverCommandServer::AnswerAgain(const driver_order_t& order, CommandStatusTable::Entry& entry) {
  const bool begins = order.kind == driver_order_t::KIND_EXECUTE || order.kind == driver_order_t::KIND_PREPARE;
  if (begins && entry.prepare != (order.kind == driver_order_t::KIND_PREPARE)) {
    return Answer(order, command_status_t::STATE_REJECTED, command_status_t::REASON_ID_REUSED,
                  "this id was used for PREPARE or EXECUTE, and this is the other: use another id");
  }
  if (order.kind == driver_order_t::KIND_CANCEL) return Cancel(entry);
  statuses_.Publish(entry);
}

bool DriverCommandServer::Admit(const driver_order_t& order) {
  const auto verdict = fence_.Check(order.bridge_boot_id, order.bridge_epoch);
  statuses_.set_bridge_epoch(fence_.newest());
  if (CommandStatusTable::Entry* const known = statuses_.Find(IdOf(order.id))) {
    AnswerAgain(order, *known);
    return order.kind == driver_order_t::KIND_CANCEL;
  }
  if (verdict == EpochFence::Verdict::kFenced) {
    Answer(order, command_status_t::STATE_REJECTED, command_status_t::REASON_FENCED,
           "another bridge has taken over this driver");
  } else if (verdict == EpochFence::Verdict::kOlder) {
    Answer(order, command_status_t::STATE_UNKNOWN, command_status_t::REASON_FENCED,
           "a newer command was received before this one");
  } else if (order.kind == driver_order_t::KIND_QUERY) {
    Answer(order, command_status_t::STATE_UNKNOWN, command_status_t::REASON_NONE,
           "this boot of the driver has not received it");
  } else if (order.kind == driver_order_t::KIND_CANCEL) {
    statuses_.End(statuses_.Add(order), command_status_t::STATE_CANCELLED, command_status_t::REASON_CANCELLED,
                  "cancelled before it arrived");
  } else {
    Begin(order);
    return true;
  }
  return false;
}

DriverCommandServer::DriverCommandServer(const BusConfig& bus, const BridgeConfig& bridge, Context context)
    : family_(*bus.family),
      bus_name_(bus.name),
      context_(std::move(context)),
      authority_(bridge),
      permits_(bus, bridge),
      statuses_(bus.name, context_.boot_id, *context_.clock, {context_.sink, context_.key}, kMaxRemembered),
      queues_(bus) {}

void DriverCommandServer::OnDriverCommand(Bytes message) {
  const auto envelope = DecodeMessage<driver_command_t>(message);
  const auto order = envelope ? DecodeMessage<driver_order_t>(envelope->order) : std::nullopt;
  if (!order || order->kind < driver_order_t::KIND_EXECUTE || order->kind > driver_order_t::KIND_PREPARE) {
    ++refused_;
    return;
  }
  // A command for an earlier boot: the bridge repeats it until it learns the new boot id. Replayed messages end here, too.
  if (order->driver_boot_id != context_.boot_id) return;
  if (!authority_.Allows(*envelope)) {
    ++refused_;
    return;
  }
  bool news = false;
  {
    const std::lock_guard lock(mutex_);
    news = Admit(*order);
  }
  if (news) context_.wake();
}

void DriverCommandServer::OnPermit(const std::string& device, Bytes message) {
  const Clock& clock = *context_.clock;
  permits_.Accept(device, message, clock.Now(), clock.UtcMicroseconds());
}

std::optional<DriverCommandServer::Taken> DriverCommandServer::Take() {
  if (!queues_.any_waiting()) return std::nullopt;
  const std::lock_guard lock(mutex_);
  const MonoNs now = statuses_.Now();
  CommandQueues::Queue* queue = queues_.Next([&](const CommandId& id) { return IsOver(id, now); });
  if (queue == nullptr) return std::nullopt;
  CommandStatusTable::Entry& entry = statuses_.At(queues_.Hold(*queue));
  entry.status.state = command_status_t::STATE_RUNNING;
  entry.status.started_utime = statuses_.UnixUs();
  statuses_.Publish(entry);
  return Taken{queue->device, entry.command};
}

std::optional<DriverCommandServer::Taken> DriverCommandServer::TakeCancel() {
  if (!cancels_) return std::nullopt;
  const std::lock_guard lock(mutex_);
  for (CommandQueues::Queue& queue : queues_.all()) {
    if (!queue.held || !queue.cancel_requested || queue.cancel_taken) continue;
    queue.cancel_taken = true;
    return Taken{queue.device, statuses_.At(*queue.held).command};
  }
  cancels_ = false;
  return std::nullopt;
}

std::optional<DriverCommandServer::Taken> DriverCommandServer::TakePrepare() {
  if (!prepares_) return std::nullopt;
  const std::lock_guard lock(mutex_);
  const MonoNs now = statuses_.Now();
  while (!to_prepare_.empty()) {
    const CommandId id = to_prepare_.front();
    to_prepare_.pop_front();
    if (IsOver(id, now)) continue;
    const CommandStatusTable::Entry& entry = statuses_.At(id);
    return Taken{entry.status.device, entry.command};
  }
  prepares_ = false;
  return std::nullopt;
}

Result<> DriverCommandServer::CheckPermit(const std::string& device, const std::string& operation) const {
  return permits_.Check(device, operation, context_.clock->Now());
}

void DriverCommandServer::Fill(CommandStatusTable::Entry& entry, const Outcome& outcome, std::int32_t epoch_after) {
  entry.status.progress = outcome.progress;
  entry.status.verified = outcome.verified ? 1 : 0;
  entry.status.epoch_after = epoch_after;
  entry.status.changes.clear();
  for (const Change& change : outcome.changes) {
    if (entry.status.changes.size() == kMaxChanges) break;
    entry.status.changes.push_back({CappedText(change.key, kNameBytes), CappedText(change.before, kChangeBytes),
                                    CappedText(change.after, kChangeBytes)});
  }
  entry.status.n_changes = static_cast<std::int8_t>(entry.status.changes.size());
}

void DriverCommandServer::Report(const std::string& device, const CommandId& id, const Outcome& outcome,
                                 std::int32_t epoch_after, std::int32_t nv_writes) {
  const std::lock_guard lock(mutex_);
  CommandQueues::Queue* queue = queues_.Holding(device, id);
  if (queue == nullptr) return;
  CommandStatusTable::Entry& entry = statuses_.At(id);
  Fill(entry, outcome, epoch_after);
  entry.status.nv_writes = nv_writes;
  if (outcome.IsFinal()) {
    queue->held.reset();
    return statuses_.End(entry, static_cast<std::int8_t>(outcome.state), outcome.reason, outcome.text);
  }
  entry.status.reason_code = outcome.reason;
  entry.status.text = CappedText(outcome.text, kTextBytes);
  if (statuses_.Now() - entry.published >= kProgressPeriod) statuses_.Publish(entry);
}

void DriverCommandServer::CountWrites(const std::string& device, const CommandId& id, std::int32_t nv_writes) {
  const std::lock_guard lock(mutex_);
  if (queues_.Holding(device, id) != nullptr) statuses_.At(id).status.nv_writes = nv_writes;
}

void DriverCommandServer::ReportPrepared(const CommandId& id, const Outcome& outcome, std::int32_t epoch_after) {
  const std::lock_guard lock(mutex_);
  CommandStatusTable::Entry* entry = statuses_.Find(id);
  if (entry == nullptr || !entry->prepare || IsFinalState(entry->status.state)) return;
  Fill(*entry, outcome, epoch_after);
  statuses_.End(*entry, static_cast<std::int8_t>(outcome.state), outcome.reason, outcome.text);
}

void DriverCommandServer::Hello(std::span<const driver_device_t> devices) {
  constexpr std::size_t kDevicesPerHello = 8;  // of the longest strings, so that the message fits one frame
  const std::lock_guard lock(mutex_);
  do {
    const auto part = devices.first(std::min(devices.size(), kDevicesPerHello));
    driver_status_t status = StatusOfKind(driver_status_t::KIND_HELLO);
    for (driver_device_t device : part) {
      device.device = CappedText(device.device, kNameBytes);
      device.identity = CappedText(device.identity, kIdentityBytes);
      status.devices.push_back(std::move(device));
    }
    status.n_devices = static_cast<std::int8_t>(status.devices.size());
    statuses_.Send(status);
    devices = devices.subspan(part.size());
  } while (!devices.empty());
}

void DriverCommandServer::PublishAcknowledged(const std::string& device, std::span<const std::string> alarms) {
  driver_status_t status = StatusOfKind(driver_status_t::KIND_ACKNOWLEDGED);
  status.device = CappedText(device, kNameBytes);
  status.text = WordsWithin(alarms, kTextBytes);
  const std::lock_guard lock(mutex_);
  statuses_.Send(status);
}

void DriverCommandServer::Stop(const CommandId& id) {
  statuses_.End(statuses_.At(id), command_status_t::STATE_REJECTED, command_status_t::REASON_STOPPING,
                "the driver stopped before it began: send it again later");
}

void DriverCommandServer::Goodbye() {
  const std::lock_guard lock(mutex_);
  stopping_ = true;
  for (const CommandId& id : to_prepare_) Stop(id);
  to_prepare_.clear();
  for (CommandQueues::Queue& queue : queues_.all()) {
    while (!queue.waiting.empty()) {
      const CommandId id = queue.waiting.front();
      Stop(id);
      static_cast<void>(queues_.Drop(queue, id));
    }
    if (!queue.held) continue;
    statuses_.End(statuses_.At(*queue.held), command_status_t::STATE_INDETERMINATE,
                  command_status_t::REASON_STOPPING,
                  "the driver stopped while the command was in progress: check the device");
    queue.held.reset();
  }
  driver_status_t status = StatusOfKind(driver_status_t::KIND_GOODBYE);
  statuses_.Send(status);
}

}  // namespace axlecast
