#include "drivers/runtime/command/command_status_table.h"

#include <algorithm>

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

CommandStatusTable::CommandStatusTable(const std::string& bus, std::int64_t boot_id, const Clock& clock,
                                       Output output, std::size_t capacity)
    : bus_(bus),
      channel_("DRIVER_STATUS/" + bus),
      boot_id_(boot_id),
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
  status.boot_id = boot_id_;
  status.seq = seq_++;
  status.bus = bus_;
  status.bridge_epoch = bridge_epoch_;
  if (output_.key != nullptr) SignMessage(*output_.key, Domain::kDriver, status);
  axlecast::Publish(*output_.sink, channel_, status);
}

}  // namespace axlecast
