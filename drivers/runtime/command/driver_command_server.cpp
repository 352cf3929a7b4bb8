#include "drivers/runtime/command/driver_command_server.h"

#include <algorithm>
#include <axlecast/command_status_t.hpp>
#include <axlecast/driver_command_t.hpp>
#include <utility>

#include "core/base/text.h"
#include "core/command/commands.h"
#include "core/messages/enum_names.h"

namespace axlecast {

CommandQueues::CommandQueues(const BusConfig& bus) : usual_(bus.devices.size()) {
  for (const bool urgent : {true, false}) {
    for (const DeviceConfig& device : bus.devices) {
      queues_.emplace_back();
      queues_.back().device = device.name;
      queues_.back().urgent = urgent;
    }
  }
}

CommandQueues::Queue* CommandQueues::Find(const std::string& device, bool urgent) {
  const auto found = std::find_if(queues_.begin(), queues_.end(), [&](const Queue& queue) {
    return queue.urgent == urgent && queue.device == device;
  });
  return found == queues_.end() ? nullptr : &*found;
}

CommandQueues::Queue* CommandQueues::Holding(const std::string& device, const CommandId& id) {
  const auto found = std::find_if(queues_.begin(), queues_.end(),
                                  [&](const Queue& queue) { return queue.device == device && queue.held == id; });
  return found == queues_.end() ? nullptr : &*found;
}

void CommandQueues::Push(Queue& queue, const CommandId& id) {
  queue.waiting.push_back(id);
  ++waiting_;
}

bool CommandQueues::Drop(Queue& queue, const CommandId& id) {
  const std::size_t dropped = std::erase(queue.waiting, id);
  waiting_ -= dropped;
  return dropped > 0;
}

bool CommandQueues::Ready(Queue& queue, const std::function<bool(const CommandId&)>& is_over) {
  waiting_ -= std::erase_if(queue.waiting, is_over);
  return !queue.held && !queue.waiting.empty();
}

CommandQueues::Queue* CommandQueues::Next(const std::function<bool(const CommandId&)>& is_over) {
  for (std::size_t i = 0; i < usual_; ++i) {
    if (Ready(queues_[i], is_over)) return &queues_[i];
  }
  for (std::size_t i = 0; i < usual_; ++i) {
    const std::size_t index = (next_ + i) % usual_;
    if (!Ready(queues_[usual_ + index], is_over)) continue;
    next_ = index + 1;
    return &queues_[usual_ + index];
  }
  return nullptr;
}

const CommandId& CommandQueues::Hold(Queue& queue) {
  queue.held = queue.waiting.front();
  queue.waiting.pop_front();
  --waiting_;
  queue.cancel_requested = queue.cancel_taken = false;
  return *queue.held;
}

std::string CommandQueues::Devices() const {
  std::string names;
  for (std::size_t i = usual_; i < queues_.size(); ++i) names += " " + queues_[i].device;
  return names;
}

driver_status_t StatusOf(const driver_order_t& order) {
  driver_status_t status{};
  status.kind = driver_status_t::KIND_STATUS;
  std::copy(std::begin(order.id), std::end(order.id), std::begin(status.id));
  status.device = CappedText(order.device, kNameBytes);
  status.operation = CappedText(order.operation, kNameBytes);
  status.epoch_after = -1;
  return status;
}

CommandStatusTable::CommandStatusTable(const std::string& bus, const Origin& origin, const Clock& clock,
                                       Output output, std::size_t capacity)
    : bus_(bus),
      channel_("DRIVER_STATUS/" + bus),
      origin_(origin),
      clock_(clock),
      output_(output),
      capacity_(capacity) {
  time_.Update(clock_.Now(), clock_.UtcMicroseconds());
}

CommandStatusTable::Entry* CommandStatusTable::Find(const CommandId& id) {
  const auto found = entries_.find(id);
  return found == entries_.end() ? nullptr : &found->second;
}

CommandStatusTable::Entry& CommandStatusTable::Add(const driver_order_t& order) {
  DeleteOldest();
  const CommandId id = IdOf(order.id);
  Entry& entry = entries_[id];
  oldest_first_.push_back(id);
  entry.status = StatusOf(order);
  entry.prepare = order.kind == driver_order_t::KIND_PREPARE;
  return entry;
}

void CommandStatusTable::DeleteOldest() {
  // Unfinished ones are few and go to the end of the line.
  for (std::size_t tries = oldest_first_.size(); entries_.size() >= capacity_ && tries > 0; --tries) {
    const CommandId id = oldest_first_.front();
    oldest_first_.pop_front();
    if (IsFinalState(At(id).status.state)) {
      entries_.erase(id);
    } else {
      oldest_first_.push_back(id);
    }
  }
}

void CommandStatusTable::Publish(Entry& entry) {
  Send(entry.status);
  entry.published = entry.status.mono_ns;
}

void CommandStatusTable::End(Entry& entry, std::int8_t state, std::int32_t reason, const std::string& text) {
  entry.status.state = state;
  entry.status.reason_code = reason;
  entry.status.text = CappedText(text, kTextBytes);
  entry.status.finished_utime = UnixUs();
  entry.command = {};
  Publish(entry);
}

void CommandStatusTable::Send(driver_status_t& status) {
  const MonoNs now = clock_.Now();
  time_.Update(now, clock_.UtcMicroseconds());
  status.mono_ns = now;
  status.utime = time_.Utime(now);
  origin_.Set(status);
  status.seq = seq_++;
  status.bus = bus_;
  status.bridge_epoch = bridge_epoch_;
  if (output_.key != nullptr) SignMessage(*output_.key, Domain::kDriver, status);
  axlecast::Publish(*output_.sink, channel_, status);
}

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
      permits_(bus, bridge, context_.origin.clock_id, context_.base),
      statuses_(bus.name, context_.origin, *context_.clock, {context_.sink, context_.key}, kMaxRemembered),
      queues_(bus) {}

void DriverCommandServer::OnDriverCommand(Bytes message) {
  const auto envelope = DecodeMessage<driver_command_t>(message);
  const auto order = envelope ? DecodeMessage<driver_order_t>(envelope->order) : std::nullopt;
  if (!order || order->kind < driver_order_t::KIND_EXECUTE || order->kind > driver_order_t::KIND_PREPARE) {
    ++refused_;
    return;
  }
  // A command for an earlier boot: the bridge repeats it until it learns the new boot id. Replayed messages end here, too.
  if (order->driver_boot_id != context_.origin.boot_id) return;
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
