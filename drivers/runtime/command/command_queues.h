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

// The commands that wait for the devices of a bus, and the command that each device executes: one at a time, and one
// urgent command in addition. The caller locks, except for any_waiting().
class CommandQueues {
 public:
  struct Queue {
    std::string device;
    bool urgent = false;
    std::deque<CommandId> waiting;
    std::optional<CommandId> held;
    bool cancel_requested = false;  // for the held command
    bool cancel_taken = false;
  };

  explicit CommandQueues(const BusConfig& bus);

  // Null for a device that is not on this bus.
  [[nodiscard]] Queue* Find(const std::string& device, bool urgent);
  // Returns the queue whose device executes the command, or null.
  [[nodiscard]] Queue* Holding(const std::string& device, const CommandId& id);

  void Push(Queue& queue, const CommandId& id);
  // Removes a waiting command. Returns false if it does not wait.
  [[nodiscard]] bool Drop(Queue& queue, const CommandId& id);
  // Returns the next queue with a waiting command and a free device: urgent queues first, the others round-robin. Waiting
  // commands for which `is_over` returns true are removed first.
  [[nodiscard]] Queue* Next(const std::function<bool(const CommandId&)>& is_over);
  // Marks the command that has waited longest as held.
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
  std::size_t next_ = 0;      // which usual one is checked first
  std::atomic<std::size_t> waiting_ = 0;
};

}  // namespace axlecast
