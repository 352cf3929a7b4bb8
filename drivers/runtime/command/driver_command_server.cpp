#include "drivers/runtime/command/driver_command_server.h"

#include <algorithm>
#include <atomic>
#include <axlecast/command_status_t.hpp>
#include <axlecast/driver_command_t.hpp>
#include <axlecast/driver_order_t.hpp>
#include <axlecast/driver_status_t.hpp>
#include <deque>
#include <mutex>
#include <utility>

#include "core/base/text.h"
#include "core/command/commands.h"
#include "core/messages/enum_names.h"
#include "core/messages/message.h"
#include "drivers/runtime/command/command_authority.h"
#include "drivers/runtime/command/command_queues.h"
#include "drivers/runtime/command/command_status_table.h"

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

bool IsUrgent(const Family& family, const std::string& operation) {
  const OperationSpec* spec = FindOperation(family, operation);
  return spec != nullptr && spec->urgent;
}

}  // namespace

struct DriverCommandServer::State {
  State(const BusConfig& bus, const BridgeConfig& bridge, Context its_context)
      : family(*bus.family),
        bus_name(bus.name),
        context(std::move(its_context)),
        authority(bridge),
        permits(bus, bridge),
        statuses(bus.name, context.boot_id, *context.clock, {context.sink, context.key}, kMaxRemembered),
        queues(bus) {}

  // All functions below require that `mutex` is held.
  // Returns false if there is nothing new for the bus's thread.
  [[nodiscard]] bool Admit(const driver_order_t& order);
  void AnswerAgain(const driver_order_t& order, CommandStatusTable::Entry& entry);
  void Answer(const driver_order_t& order, std::int8_t state, std::int32_t reason, const char* text);
  void Begin(const driver_order_t& order);
  void Cancel(CommandStatusTable::Entry& entry);
  [[nodiscard]] Result<> Check(const driver_order_t& order);
  // Ends a command that waited too long.
  [[nodiscard]] bool IsOver(const CommandId& id, MonoNs now);
  static void Fill(CommandStatusTable::Entry& entry, const Outcome& outcome, std::int32_t epoch_after);
  void Stop(const CommandId& id);

  const Family& family;
  const std::string bus_name;
  const Context context;
  const CommandAuthority authority;

  std::atomic<std::int64_t> refused = 0;
  std::atomic<bool> cancels = false;
  std::atomic<bool> prepares = false;
  PermitTable permits;  // locks itself

  mutable std::mutex mutex;
  EpochFence fence;
  CommandStatusTable statuses;
  CommandQueues queues;
  std::deque<CommandId> to_prepare;
  bool stopping = false;
};

void DriverCommandServer::State::Answer(const driver_order_t& order, std::int8_t state, std::int32_t reason,
                                        const char* text) {
  driver_status_t status = StatusOf(order);
  status.state = state;
  status.reason_code = reason;
  status.text = text;
  statuses.Send(status);
}

Result<> DriverCommandServer::State::Check(const driver_order_t& order) {
  using Reason = command_status_t;
  if (stopping) return Failure("the driver is stopping: send it again later", Reason::REASON_STOPPING);
  const CommandQueues::Queue* queue = queues.Find(order.device, IsUrgent(family, order.operation));
  if (queue == nullptr) {
    return Failure("no such device on " + bus_name + "; it has:" + queues.Devices(), Reason::REASON_UNKNOWN_DEVICE);
  }
  const OperationSpec* operation = FindOperation(family, order.operation);
  if (operation == nullptr) {
    return Failure("no such operation; " + OperationNames(family), Reason::REASON_UNKNOWN_OPERATION);
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
  if ((prepare ? to_prepare.size() : queue->waiting.size()) >= kMaxWaiting) {
    return Failure("16 commands wait for this device: send it again later", Reason::REASON_QUEUE_FULL);
  }
  return {};
}

void DriverCommandServer::State::Begin(const driver_order_t& order) {
  const Result<> checked = Check(order);
  CommandStatusTable::Entry& entry = statuses.Add(order);
  if (!checked) {
    return statuses.End(entry, command_status_t::STATE_REJECTED, checked.error().reason, checked.error().text);
  }
  entry.command = CommandOf(order, statuses.Now());
  entry.status.state = command_status_t::STATE_ROUTED;
  if (entry.prepare) {
    to_prepare.push_back(entry.command.id);
    prepares = true;
  } else {
    queues.Push(*queues.Find(order.device, IsUrgent(family, order.operation)), entry.command.id);
  }
  statuses.Publish(entry);
}

void DriverCommandServer::State::Cancel(CommandStatusTable::Entry& entry) {
  const CommandId id = IdOf(entry.status.id);
  if (IsFinalState(entry.status.state)) return statuses.Publish(entry);
  CommandQueues::Queue& queue = *queues.Find(entry.status.device, IsUrgent(family, entry.status.operation));
  if (entry.prepare ? std::erase(to_prepare, id) > 0 : queues.Drop(queue, id)) {
    return statuses.End(entry, command_status_t::STATE_CANCELLED, command_status_t::REASON_CANCELLED,
                        "cancelled before it began");
  }
  if (queue.held == id) {
    queue.cancel_requested = true;
    cancels = true;
  }
  statuses.Publish(entry);
}

bool DriverCommandServer::State::IsOver(const CommandId& id, MonoNs now) {
  CommandStatusTable::Entry& entry = statuses.At(id);
  if (now <= entry.command.begin_by) return false;
  statuses.End(entry, command_status_t::STATE_EXPIRED, command_status_t::REASON_DEADLINE,
               "its time ran out while it waited for the device");
  return true;
}

void DriverCommandServer::State::AnswerAgain(const driver_order_t& order, CommandStatusTable::Entry& entry) {
  const bool begins = order.kind == driver_order_t::KIND_EXECUTE || order.kind == driver_order_t::KIND_PREPARE;
  if (begins && entry.prepare != (order.kind == driver_order_t::KIND_PREPARE)) {
    return Answer(order, command_status_t::STATE_REJECTED, command_status_t::REASON_ID_REUSED,
                  "this id was used for PREPARE or EXECUTE, and this is the other: use another id");
  }
  if (order.kind == driver_order_t::KIND_CANCEL) return Cancel(entry);
  statuses.Publish(entry);
}

bool DriverCommandServer::State::Admit(const driver_order_t& order) {
  const auto verdict = fence.Check(order.bridge_boot_id, order.bridge_epoch);
  statuses.set_bridge_epoch(fence.newest());
  if (CommandStatusTable::Entry* const known = statuses.Find(IdOf(order.id))) {
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
    statuses.End(statuses.Add(order), command_status_t::STATE_CANCELLED, command_status_t::REASON_CANCELLED,
                 "cancelled before it arrived");
  } else {
    Begin(order);
    return true;
  }
  return false;
}

DriverCommandServer::DriverCommandServer(const BusConfig& bus, const BridgeConfig& bridge, Context context)
    : state_(std::make_unique<State>(bus, bridge, std::move(context))) {}
DriverCommandServer::~DriverCommandServer() = default;

void DriverCommandServer::OnDriverCommand(Bytes message) {
  const auto envelope = DecodeMessage<driver_command_t>(message);
  const auto order = envelope ? DecodeMessage<driver_order_t>(envelope->order) : std::nullopt;
  if (!order || order->kind < driver_order_t::KIND_EXECUTE || order->kind > driver_order_t::KIND_PREPARE) {
    ++state_->refused;
    return;
  }
  // A command for an earlier boot: the bridge repeats it until it learns the new boot id. Replayed messages end here, too.
  if (order->driver_boot_id != state_->context.boot_id) return;
  if (!state_->authority.Allows(*envelope)) {
    ++state_->refused;
    return;
  }
  bool news = false;
  {
    const std::lock_guard lock(state_->mutex);
    news = state_->Admit(*order);
  }
  if (news) state_->context.wake();
}

void DriverCommandServer::OnPermit(const std::string& device, Bytes message) {
  const Clock& clock = *state_->context.clock;
  state_->permits.Accept(device, message, clock.Now(), clock.UtcMicroseconds());
}

std::int64_t DriverCommandServer::refused() const { return state_->refused; }

std::string_view DriverCommandServer::Rule() const { return state_->authority.Rule(); }

std::optional<DriverCommandServer::Taken> DriverCommandServer::Take() {
  if (!state_->queues.any_waiting()) return std::nullopt;
  const std::lock_guard lock(state_->mutex);
  const MonoNs now = state_->statuses.Now();
  CommandQueues::Queue* queue = state_->queues.Next([&](const CommandId& id) { return state_->IsOver(id, now); });
  if (queue == nullptr) return std::nullopt;
  CommandStatusTable::Entry& entry = state_->statuses.At(state_->queues.Hold(*queue));
  entry.status.state = command_status_t::STATE_RUNNING;
  entry.status.started_utime = state_->statuses.UnixUs();
  state_->statuses.Publish(entry);
  return Taken{queue->device, entry.command};
}

std::optional<DriverCommandServer::Taken> DriverCommandServer::TakeCancel() {
  if (!state_->cancels) return std::nullopt;
  const std::lock_guard lock(state_->mutex);
  for (CommandQueues::Queue& queue : state_->queues.all()) {
    if (!queue.held || !queue.cancel_requested || queue.cancel_taken) continue;
    queue.cancel_taken = true;
    return Taken{queue.device, state_->statuses.At(*queue.held).command};
  }
  state_->cancels = false;
  return std::nullopt;
}

std::optional<DriverCommandServer::Taken> DriverCommandServer::TakePrepare() {
  if (!state_->prepares) return std::nullopt;
  const std::lock_guard lock(state_->mutex);
  const MonoNs now = state_->statuses.Now();
  while (!state_->to_prepare.empty()) {
    const CommandId id = state_->to_prepare.front();
    state_->to_prepare.pop_front();
    if (state_->IsOver(id, now)) continue;
    const CommandStatusTable::Entry& entry = state_->statuses.At(id);
    return Taken{entry.status.device, entry.command};
  }
  state_->prepares = false;
  return std::nullopt;
}

Result<> DriverCommandServer::CheckPermit(const std::string& device, const std::string& operation) const {
  return state_->permits.Check(device, operation, state_->context.clock->Now());
}

void DriverCommandServer::State::Fill(CommandStatusTable::Entry& entry, const Outcome& outcome,
                                      std::int32_t epoch_after) {
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
  const std::lock_guard lock(state_->mutex);
  CommandQueues::Queue* queue = state_->queues.Holding(device, id);
  if (queue == nullptr) return;
  CommandStatusTable::Entry& entry = state_->statuses.At(id);
  State::Fill(entry, outcome, epoch_after);
  entry.status.nv_writes = nv_writes;
  if (outcome.IsFinal()) {
    queue->held.reset();
    return state_->statuses.End(entry, static_cast<std::int8_t>(outcome.state), outcome.reason, outcome.text);
  }
  entry.status.reason_code = outcome.reason;
  entry.status.text = CappedText(outcome.text, kTextBytes);
  if (state_->statuses.Now() - entry.published >= kProgressPeriod) state_->statuses.Publish(entry);
}

void DriverCommandServer::CountWrites(const std::string& device, const CommandId& id, std::int32_t nv_writes) {
  const std::lock_guard lock(state_->mutex);
  if (state_->queues.Holding(device, id) != nullptr) state_->statuses.At(id).status.nv_writes = nv_writes;
}

void DriverCommandServer::ReportPrepared(const CommandId& id, const Outcome& outcome, std::int32_t epoch_after) {
  const std::lock_guard lock(state_->mutex);
  CommandStatusTable::Entry* entry = state_->statuses.Find(id);
  if (entry == nullptr || !entry->prepare || IsFinalState(entry->status.state)) return;
  State::Fill(*entry, outcome, epoch_after);
  state_->statuses.End(*entry, static_cast<std::int8_t>(outcome.state), outcome.reason, outcome.text);
}

void DriverCommandServer::Hello(std::span<const DeviceSummary> devices) {
  const std::lock_guard lock(state_->mutex);
  do {
    const auto part = devices.first(std::min(devices.size(), kDevicesPerHello));
    driver_status_t status{};
    status.kind = driver_status_t::KIND_HELLO;
    status.epoch_after = -1;
    for (const DeviceSummary& device : part) status.devices.push_back(MessageOf(device));
    status.n_devices = static_cast<std::int8_t>(status.devices.size());
    state_->statuses.Send(status);
    devices = devices.subspan(part.size());
  } while (!devices.empty());
}

void DriverCommandServer::PublishAcknowledged(const std::string& device, std::span<const std::string> alarms) {
  driver_status_t status{};
  status.kind = driver_status_t::KIND_ACKNOWLEDGED;
  status.epoch_after = -1;
  status.device = CappedText(device, kNameBytes);
  status.text = WordsWithin(alarms, kTextBytes);
  const std::lock_guard lock(state_->mutex);
  state_->statuses.Send(status);
}

void DriverCommandServer::State::Stop(const CommandId& id) {
  statuses.End(statuses.At(id), command_status_t::STATE_REJECTED, command_status_t::REASON_STOPPING,
               "the driver stopped before it began: send it again later");
}

void DriverCommandServer::Goodbye() {
  const std::lock_guard lock(state_->mutex);
  state_->stopping = true;
  for (const CommandId& id : state_->to_prepare) state_->Stop(id);
  state_->to_prepare.clear();
  for (CommandQueues::Queue& queue : state_->queues.all()) {
    while (!queue.waiting.empty()) {
      const CommandId id = queue.waiting.front();
      state_->Stop(id);
      static_cast<void>(state_->queues.Drop(queue, id));
    }
    if (!queue.held) continue;
    state_->statuses.End(state_->statuses.At(*queue.held), command_status_t::STATE_INDETERMINATE,
                         command_status_t::REASON_STOPPING,
                         "the driver stopped while the command was in progress: check the device");
    queue.held.reset();
  }
  driver_status_t status{};
  status.kind = driver_status_t::KIND_GOODBYE;
  status.epoch_after = -1;
  state_->statuses.Send(status);
}

}  // namespace axlecast
