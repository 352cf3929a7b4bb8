#pragma once

#include <atomic>
#include <cstddef>
#include <deque>
#include <functional>
#include <map>
#include <optional>
#include <string>

#include "core/config/machine_config.h"
#include "core/device/operation.h"

namespace axlecast {

// Which orders wait for the devices of a bus, and which each device holds: one at a time, and an urgent one beside
// it. The caller locks, except for any_waiting().
class OrderQueues {
 public:
  struct Queue {
    std::string device;
    bool urgent = false;
    std::deque<CommandId> waiting;
    std::optional<CommandId> held;
    bool cancel_asked = false;  // of the held one
    bool cancel_taken = false;
  };

  explicit OrderQueues(const BusConfig& bus);

  // Null for a device that is not on this bus.
  [[nodiscard]] Queue* Find(const std::string& device, bool urgent);
  // The queue whose device holds the order, or null.
  [[nodiscard]] Queue* Holding(const std::string& device, const CommandId& id);

  void Push(Queue& queue, const CommandId& id);
  // Takes it out of those that wait; false when it is not there.
  [[nodiscard]] bool Drop(Queue& queue, const CommandId& id);
  // The next queue whose device is free and has an order waiting: urgent ones first, else by turns. Before a queue
  // is looked at, those of its waiting orders go for which `is_over`.
  [[nodiscard]] Queue* Next(const std::function<bool(const CommandId&)>& is_over);
  // The order that waited longest is held from now on.
  const CommandId& Hold(Queue& queue);

  // Of all queues; any thread.
  [[nodiscard]] bool any_waiting() const { return waiting_ > 0; }
  [[nodiscard]] std::deque<Queue>& all() { return queues_; }
  // " axis1 axis2"
  [[nodiscard]] std::string Devices() const;

 private:
  [[nodiscard]] bool Ready(Queue& queue, const std::function<bool(const CommandId&)>& is_over);

  std::deque<Queue> queues_;  // the urgent ones, then the usual ones
  std::size_t usual_;         // index of the first usual one
  std::size_t next_ = 0;      // which usual one is asked first
  std::atomic<std::size_t> waiting_ = 0;
};

}  // namespace axlecast
