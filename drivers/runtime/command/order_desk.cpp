#include "drivers/runtime/command/order_desk.h"

#include <algorithm>
#include <atomic>
#include <axlecast/command_status_t.hpp>
#include <axlecast/driver_command_t.hpp>
#include <axlecast/driver_order_t.hpp>
#include <axlecast/driver_status_t.hpp>
#include <deque>
#include <mutex>
#include <utility>

#include "drivers/runtime/command/bridge_fence.h"
#include "drivers/runtime/command/capped_text.h"
#include "drivers/runtime/command/command_words.h"
#include "drivers/runtime/command/operation_check.h"
#include "drivers/runtime/command/order_ledger.h"
#include "drivers/runtime/command/permit_book.h"
#include "drivers/runtime/core/decode_message.h"

namespace axlecast {
namespace {

constexpr MonoNs kProgressPeriod = 50 * kMillisecond;
constexpr std::int32_t kMaxValidMs = 3'600'000;
constexpr std::size_t kDevicesPerHello = 8;

// One device's orders, the urgent ones apart: those that wait, and the one that it holds.
struct Queue {
  std::deque<CommandId> waiting;
  std::optional<CommandId> held;
  bool cancel_asked = false;  // of the held one
  bool cancel_taken = false;
};

Order OrderOf(const driver_order_t& message, MonoNs now) {
  Order order;
  order.id = IdOf(message.id);
  order.operation = message.operation;
  for (const argument_t& argument : message.arguments) order.arguments.emplace_back(argument.key, argument.value);
  order.begin_by = now + message.valid_ms * kMillisecond;
  order.expect_epoch = message.expect_epoch;
  return order;
}

driver_device_t MessageOf(const OrderDesk::DeviceSummary& device) {
  driver_device_t message{};
  message.device = CappedText(device.device, kNameBytes);
  message.state = device.state;
  message.datum_epoch = device.datum_epoch;
  message.reference_lost = device.reference_lost ? 1 : 0;
  message.identity = CappedText(device.identity, kIdentityBytes);
  if (device.datum) {
    message.has_datum = 1;
    message.datum_counts = device.datum->counts;
    message.datum_utime = device.datum->utime;
  }
  if (device.position) {
    message.has_position = 1;
    message.position = device.position->counts;
    message.position_utime = device.position->utime;
  }
  return message;
}

// Sorts the urgent queues of all devices first.
struct QueueKey {
  bool usual = true;
  std::string device;

  friend auto operator<=>(const QueueKey&, const QueueKey&) = default;
};

}  // namespace

struct OrderDesk::State {
  State(const BusConfig& bus, Context its_context)
      : family(*bus.family),
        bus_name(bus.name),
        context(std::move(its_context)),
        permits(bus),
        ledger(bus.name, context.boot_id, *context.clock, *context.sink, kMaxRemembered) {
    for (const DeviceConfig& device : bus.devices) {
      for (const bool usual : {false, true}) queues[{usual, device.name}];
    }
  }

  // All below: with `mutex` held.
  void Answer(const driver_order_t& order, std::int8_t state, std::int32_t reason, const char* text);
  void Execute(const driver_order_t& order);
  void Cancel(OrderLedger::Entry& entry);
  [[nodiscard]] std::optional<Refusal> Check(const driver_order_t& order) const;
  void ExpireWaiting(Queue& queue, MonoNs now);
  Taken Hand(const QueueKey& key, Queue& queue);
  [[nodiscard]] bool IsUrgent(const std::string& operation) const {
    const OperationSpec* spec = FindOperation(family, operation);
    return spec != nullptr && spec->urgent;
  }
  [[nodiscard]] Queue* QueueOf(const std::string& device, const std::string& operation) {
    const auto queue = queues.find({!IsUrgent(operation), device});
    return queue == queues.end() ? nullptr : &queue->second;
  }

  const Family& family;
  const std::string bus_name;
  const Context context;

  std::atomic<std::size_t> waiting = 0;  // in all queues: lets Take pass without the lock
  std::atomic<bool> cancels = false;

  mutable std::mutex mutex;
  PermitBook permits;
  BridgeFence fence;
  OrderLedger ledger;
  std::map<QueueKey, Queue> queues;
  QueueKey served_last;  // the next device is asked first
  bool stopping = false;
};

void OrderDesk::State::Answer(const driver_order_t& order, std::int8_t state, std::int32_t reason,
                              const char* text) {
  driver_status_t status = StatusOf(order);
  status.state = state;
  status.reason_code = reason;
  status.text = text;
  ledger.Send(status);
}

std::optional<Refusal> OrderDesk::State::Check(const driver_order_t& order) const {
  if (stopping) return Refusal{command_status_t::REASON_STOPPING, "the driver is stopping: send it again later"};
  const auto queue = queues.find({!IsUrgent(order.operation), order.device});
  if (queue == queues.end()) {
    std::string known;
    for (const auto& [key, unused] : queues) known += key.usual ? " " + key.device : "";
    return Refusal{command_status_t::REASON_UNKNOWN_DEVICE, "no such device on " + bus_name + "; it has:" + known};
  }
  const OperationSpec* operation = FindOperation(family, order.operation);
  if (operation == nullptr) {
    return Refusal{command_status_t::REASON_UNKNOWN_OPERATION, "no such operation; " + OperationNames(family)};
  }
  if (auto refusal = CheckArguments(*operation, order.arguments)) return refusal;
  if (order.valid_ms < 1 || order.valid_ms > kMaxValidMs) {
    return Refusal{command_status_t::REASON_MALFORMED, "valid_ms is outside 1..3600000"};
  }
  if (queue->second.waiting.size() >= kMaxWaiting) {
    return Refusal{command_status_t::REASON_QUEUE_FULL, "16 orders wait for this device: send it again later"};
  }
  return std::nullopt;
}

void OrderDesk::State::Execute(const driver_order_t& order) {
  const auto refusal = Check(order);
  OrderLedger::Entry& entry = ledger.Remember(order);
  if (refusal) return ledger.End(entry, command_status_t::STATE_REJECTED, refusal->reason, refusal->text);
  entry.order = OrderOf(order, ledger.Now());
  entry.status.state = command_status_t::STATE_ROUTED;
  QueueOf(order.device, order.operation)->waiting.push_back(entry.order.id);
  ledger.Publish(entry);
  ++waiting;
}

void OrderDesk::State::Cancel(OrderLedger::Entry& entry) {
  const CommandId id = IdOf(entry.status.id);
  if (IsFinalState(entry.status.state)) return ledger.Publish(entry);
  Queue& queue = *QueueOf(entry.status.device, entry.status.operation);
  if (std::erase(queue.waiting, id) > 0) {
    --waiting;
    return ledger.End(entry, command_status_t::STATE_CANCELLED, command_status_t::REASON_CANCELLED,
                      "cancelled before it began");
  }
  queue.cancel_asked = true;
  cancels = true;
  ledger.Publish(entry);
}

void OrderDesk::State::ExpireWaiting(Queue& queue, MonoNs now) {
  std::erase_if(queue.waiting, [&](const CommandId& id) {
    OrderLedger::Entry& entry = ledger.At(id);
    if (now <= entry.order.begin_by) return false;
    --waiting;
    ledger.End(entry, command_status_t::STATE_EXPIRED, command_status_t::REASON_DEADLINE,
               "its time ran out while it waited for the device");
    return true;
  });
}

OrderDesk::Taken OrderDesk::State::Hand(const QueueKey& key, Queue& queue) {
  queue.held = queue.waiting.front();
  queue.waiting.pop_front();
  queue.cancel_asked = queue.cancel_taken = false;
  --waiting;
  if (key.usual) served_last = key;
  OrderLedger::Entry& entry = ledger.At(*queue.held);
  entry.status.state = command_status_t::STATE_RUNNING;
  entry.status.started_utime = ledger.Utime();
  ledger.Publish(entry);
  return {key.device, entry.order};
}

OrderDesk::OrderDesk(const BusConfig& bus, Context context)
    : state_(std::make_unique<State>(bus, std::move(context))) {}
OrderDesk::~OrderDesk() = default;

void OrderDesk::OnDriverCommand(Bytes message) {
  const auto envelope = DecodeMessage<driver_command_t>(message);
  if (!envelope) return;
  const auto order = DecodeMessage<driver_order_t>(envelope->order);
  if (!order || order->driver_boot_id != state_->context.boot_id) return;
  if (order->kind < driver_order_t::KIND_EXECUTE || order->kind > driver_order_t::KIND_QUERY) return;
  {
    const std::lock_guard lock(state_->mutex);
    const auto verdict = state_->fence.Judge(order->bridge_boot_id, order->bridge_epoch);
    state_->ledger.set_bridge_epoch(state_->fence.newest());
    OrderLedger::Entry* const known = state_->ledger.Find(IdOf(order->id));
    if (known != nullptr) {
      if (order->kind != driver_order_t::KIND_CANCEL) return state_->ledger.Publish(*known);
      state_->Cancel(*known);
    } else if (verdict == BridgeFence::Verdict::kFenced) {
      return state_->Answer(*order, command_status_t::STATE_REJECTED, command_status_t::REASON_FENCED,
                            "another bridge has taken over this driver");
    } else if (verdict == BridgeFence::Verdict::kOlder) {
      return state_->Answer(*order, command_status_t::STATE_UNKNOWN, command_status_t::REASON_FENCED,
                            "a newer order has overtaken this one");
    } else if (order->kind == driver_order_t::KIND_QUERY) {
      return state_->Answer(*order, command_status_t::STATE_UNKNOWN, command_status_t::REASON_NONE,
                            "this boot of the driver never saw it");
    } else if (order->kind == driver_order_t::KIND_CANCEL) {
      return state_->ledger.End(state_->ledger.Remember(*order), command_status_t::STATE_CANCELLED,
                                command_status_t::REASON_CANCELLED, "cancelled before it arrived");
    } else {
      state_->Execute(*order);
    }
  }
  state_->context.wake();
}

void OrderDesk::OnPermit(const std::string& device, Bytes message) {
  const std::lock_guard lock(state_->mutex);
  state_->permits.Accept(device, message, state_->ledger.Now());
}

std::optional<OrderDesk::Taken> OrderDesk::Take() {
  if (state_->waiting == 0) return std::nullopt;
  const std::lock_guard lock(state_->mutex);
  const MonoNs now = state_->ledger.Now();
  const auto ready = [&](Queue& queue) {
    state_->ExpireWaiting(queue, now);
    return !queue.held && !queue.waiting.empty();
  };
  const auto usual = state_->queues.lower_bound({true, ""});
  for (auto urgent = state_->queues.begin(); urgent != usual; ++urgent) {
    if (ready(urgent->second)) return state_->Hand(urgent->first, urgent->second);
  }
  auto next = state_->queues.upper_bound(state_->served_last);
  for (auto i = usual; i != state_->queues.end(); ++i, ++next) {
    if (next == state_->queues.end()) next = usual;
    if (ready(next->second)) return state_->Hand(next->first, next->second);
  }
  return std::nullopt;
}

std::optional<OrderDesk::Taken> OrderDesk::TakeCancel() {
  if (!state_->cancels) return std::nullopt;
  const std::lock_guard lock(state_->mutex);
  for (auto& [key, queue] : state_->queues) {
    if (!queue.held || !queue.cancel_asked || queue.cancel_taken) continue;
    queue.cancel_taken = true;
    return Taken{key.device, state_->ledger.At(*queue.held).order};
  }
  state_->cancels = false;
  return std::nullopt;
}

bool OrderDesk::HasPermit(const std::string& device, const std::string& operation) const {
  const std::lock_guard lock(state_->mutex);
  return state_->permits.Holds(device, operation, state_->ledger.Now());
}

void OrderDesk::Report(const std::string& device, const CommandId& id, const Outcome& outcome,
                       std::int32_t epoch_after) {
  const std::lock_guard lock(state_->mutex);
  Queue* queue = nullptr;
  for (const bool usual : {false, true}) {
    const auto found = state_->queues.find({usual, device});
    if (found != state_->queues.end() && found->second.held == id) queue = &found->second;
  }
  if (queue == nullptr) return;
  OrderLedger::Entry& entry = state_->ledger.At(id);
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
  if (outcome.IsFinal()) {
    queue->held.reset();
    return state_->ledger.End(entry, static_cast<std::int8_t>(outcome.state), outcome.reason, outcome.text);
  }
  entry.status.reason_code = outcome.reason;
  entry.status.text = CappedText(outcome.text, kTextBytes);
  if (state_->ledger.Now() - entry.published >= kProgressPeriod) state_->ledger.Publish(entry);
}

void OrderDesk::Hello(std::span<const DeviceSummary> devices) {
  const std::lock_guard lock(state_->mutex);
  do {
    const auto part = devices.first(std::min(devices.size(), kDevicesPerHello));
    driver_status_t status{};
    status.kind = driver_status_t::KIND_HELLO;
    status.epoch_after = -1;
    for (const DeviceSummary& device : part) {
      status.devices.push_back(MessageOf(device));
    }
    status.n_devices = static_cast<std::int8_t>(status.devices.size());
    state_->ledger.Send(status);
    devices = devices.subspan(part.size());
  } while (!devices.empty());
}

void OrderDesk::Goodbye() {
  const std::lock_guard lock(state_->mutex);
  state_->stopping = true;
  for (auto& [key, queue] : state_->queues) {
    for (const CommandId& id : queue.waiting) {
      state_->ledger.End(state_->ledger.At(id), command_status_t::STATE_REJECTED, command_status_t::REASON_STOPPING,
                         "the driver stopped before it began: send it again later");
    }
    state_->waiting -= queue.waiting.size();
    queue.waiting.clear();
    if (!queue.held) continue;
    state_->ledger.End(state_->ledger.At(*queue.held), command_status_t::STATE_INDETERMINATE,
                       command_status_t::REASON_STOPPING,
                       "the driver stopped while it worked on this: look at the device");
    queue.held.reset();
  }
  driver_status_t status{};
  status.kind = driver_status_t::KIND_GOODBYE;
  status.epoch_after = -1;
  state_->ledger.Send(status);
}

}  // namespace axlecast
