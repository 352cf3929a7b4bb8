#include "drivers/runtime/command/command_queues.h"

#include <algorithm>

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
    const std::size_t turn = (next_ + i) % usual_;
    if (!Ready(queues_[usual_ + turn], is_over)) continue;
    next_ = turn + 1;
    return &queues_[usual_ + turn];
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

}  // namespace axlecast
