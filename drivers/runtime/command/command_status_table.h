#pragma once

#include <atomic>
#include <axlecast/driver_order_t.hpp>
#include <axlecast/driver_status_t.hpp>
#include <cstddef>
#include <cstdint>
#include <deque>
#include <functional>
#include <map>
#include <optional>
#include <string>

#include "core/base/time.h"
#include "core/command/keys.h"
#include "core/config/machine_config.h"
#include "core/device/operation.h"
#include "core/messages/message.h"

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

// The commands of this boot of a driver, and their statuses on the channel DRIVER_STATUS.
class CommandStatusTable {
 public:
  struct Entry {
    driver_status_t status{};
    DriverCommand command;  // until it is finished
    bool prepare = false;   // KIND_PREPARE
    MonoNs published = 0;   // last
  };

  struct Output {
    MessageSink* sink;
    const SigningKey* key;  // null: statuses are unsigned
  };
  // Stores at most `capacity` ids. The oldest finished id is deleted first.
  CommandStatusTable(const std::string& bus, std::int64_t boot_id, const Clock& clock, Output output,
                     std::size_t capacity);

  [[nodiscard]] Entry* Find(const CommandId& id);
  [[nodiscard]] Entry& At(const CommandId& id) { return entries_.at(id); }
  Entry& Add(const driver_order_t& order);

  void Publish(Entry& entry);
  // Sets and publishes the final state of a command.
  void End(Entry& entry, std::int8_t state, std::int32_t reason, const std::string& text);
  // Completes the header, signs and publishes.
  void Send(driver_status_t& status);

  [[nodiscard]] MonoNs Now() const { return clock_.Now(); }
  [[nodiscard]] std::int64_t UnixUs() const { return time_.Utime(clock_.Now()); }
  void set_bridge_epoch(std::int64_t newest) { bridge_epoch_ = newest; }

 private:
  void DeleteOldest();

  const std::string bus_;
  const std::string channel_;
  const std::int64_t boot_id_;
  const Clock& clock_;
  const Output output_;
  const std::size_t capacity_;

  Timebase time_;
  std::int64_t seq_ = 0;
  std::int64_t bridge_epoch_ = 0;
  std::map<CommandId, Entry> entries_;
  std::deque<CommandId> oldest_first_;
};

// Returns a status for this command. The caller sets its state.
[[nodiscard]] driver_status_t StatusOf(const driver_order_t& order);

}  // namespace axlecast
