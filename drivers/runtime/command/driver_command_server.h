#pragma once

#include <atomic>
#include <axlecast/driver_device_t.hpp>
#include <axlecast/driver_order_t.hpp>
#include <axlecast/driver_status_t.hpp>
#include <cstddef>
#include <cstdint>
#include <deque>
#include <functional>
#include <map>
#include <mutex>
#include <optional>
#include <span>
#include <string>
#include <string_view>

#include "core/base/result.h"
#include "core/base/time.h"
#include "core/command/keys.h"
#include "core/config/machine_config.h"
#include "core/device/family.h"
#include "core/device/operation.h"
#include "core/messages/message.h"
#include "core/messages/origin.h"
#include "drivers/runtime/command/command_authority.h"

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
  CommandStatusTable(const std::string& bus, const Origin& origin, const Clock& clock, Output output,
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
  const Origin origin_;
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

// The driver's side of a command: receives driver_command_t and permit_t, and answers with driver_status_t.
// Used by two threads: the command thread (On...) and the bus's thread (the other functions). It never waits for the bus,
// and verifies no signature while it holds its lock.
class DriverCommandServer {
 public:
  struct Context {
    Origin origin;
    const Clock* clock = nullptr;
    MessageSink* sink = nullptr;       // of the command port
    std::function<void()> wake;        // ends the bus's sleep
    const SigningKey* key = nullptr;   // signs every status; null: statuses are unsigned
    const BaseClaims* base = nullptr;  // this host's place on the time base, for permits; null: not known
  };
  DriverCommandServer(const BusConfig& bus, const BridgeConfig& bridge, Context context);

  static constexpr std::size_t kMaxWaiting = 16;       // commands per device
  static constexpr std::size_t kMaxRemembered = 4096;  // ids; the oldest finished id is deleted first

  // Command thread. Takes a command:
  // - A command for an earlier boot of the driver is ignored. A command that cannot be decoded, or whose signature the
  //   machine's file does not allow (CommandAuthority), is counted and not answered.
  // - Every other command is acknowledged at once. It is refused if the epoch of the bridge, the device, the operation or
  //   its arguments do not allow it.
  // - A repeated id and a query are answered only. An id is never executed twice, even if it is no longer stored: an
  //   unknown id acts only with an epoch newer than every earlier one. The answer STATE_UNKNOWN therefore guarantees that
  //   no command up to its bridge_epoch with this id was or will be executed.
  // - KIND_PREPARE is answered like EXECUTE, but never begins. Its id cannot be used for another kind.
  void OnDriverCommand(Bytes message);
  void OnPermit(const std::string& device, Bytes message);

  // Any thread: how many commands were counted and not answered, and which commands are executed.
  [[nodiscard]] std::int64_t refused() const { return refused_; }
  [[nodiscard]] std::string_view Rule() const { return authority_.Rule(); }

  // Bus's thread: returns the next command for a device that is not busy. Urgent commands come first, also for a busy
  // device. Expired commands are answered EXPIRED here.
  struct Taken {
    std::string device;
    DriverCommand command;
  };
  [[nodiscard]] std::optional<Taken> Take();
  // Returns the next command that the bridge has cancelled while a device executes it.
  [[nodiscard]] std::optional<Taken> TakeCancel();
  // Returns the next PREPARE of any device, busy or not. ReportPrepared takes what EXECUTE would report.
  [[nodiscard]] std::optional<Taken> TakePrepare();
  void ReportPrepared(const CommandId& id, const Outcome& outcome, std::int32_t epoch_after);
  // See PermitTable::Check.
  [[nodiscard]] Result<> CheckPermit(const std::string& device, const std::string& operation) const;
  // Reports progress or the outcome of a command. Only the first final outcome is used. Progress is published at most
  // every 50 ms, with at most four changes. `nv_writes`: writes to memory of limited endurance since the command began.
  void Report(const std::string& device, const CommandId& id, const Outcome& outcome, std::int32_t epoch_after,
              std::int32_t nv_writes = 0);
  // Sets the writes of a command that has not ended and will not be reported again.
  void CountWrites(const std::string& device, const CommandId& id, std::int32_t nv_writes);

  // Publishes HELLO with the summaries of the devices. Call it once per second and on changes.
  void Hello(std::span<const driver_device_t> devices);
  // Publishes which alarms of a device are acknowledged. Call it once per second and on changes.
  void PublishAcknowledged(const std::string& device, std::span<const std::string> alarms);
  // Ends waiting commands as REJECTED, and commands that a device executes as INDETERMINATE. Later commands are REJECTED.
  void Goodbye();

 private:
  // All functions below require that mutex_ is held.
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

  const Family& family_;
  const std::string bus_name_;
  const Context context_;
  const CommandAuthority authority_;

  std::atomic<std::int64_t> refused_ = 0;
  std::atomic<bool> cancels_ = false;
  std::atomic<bool> prepares_ = false;
  PermitTable permits_;  // locks itself

  mutable std::mutex mutex_;
  EpochFence fence_;
  CommandStatusTable statuses_;
  CommandQueues queues_;
  std::deque<CommandId> to_prepare_;
  bool stopping_ = false;
};

}  // namespace axlecast
