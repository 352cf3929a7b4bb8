#pragma once

#include <axlecast/driver_status_t.hpp>
#include <cstddef>
#include <cstdint>
#include <deque>
#include <optional>
#include <string>

#include "bridge/dispatch/command_port.h"
#include "bridge/state/command_store.h"

namespace axlecast {

// What a queue does to the outside.
class DeviceQueueListener {
 public:
  virtual ~DeviceQueueListener() = default;
  // Sends driver_order_t KIND_* for the command, with a new bridge epoch, which it returns.
  virtual std::int64_t Send(const PendingCommand& pending, std::int8_t kind, std::int32_t valid_ms,
                            Timestamp now) = 0;
  virtual CommandId NewId() = 0;  // for what the bridge itself orders
  // Called before the command is sent to status.driver_boot_id. Returns an error if it must not be sent. Otherwise sets
  // command.journal_state: kReady, or kRouted if the journal must write it first (DeviceQueue::OnJournalled).
  [[nodiscard]] virtual Result<> BeforeRoute(PendingCommand& pending, Timestamp now) = 0;
  // Returns an error if a command has waited too long for the journal.
  [[nodiscard]] virtual Result<> CheckJournalWait(const PendingCommand& pending, Timestamp now) = 0;
  virtual void OnStep(PendingCommand& pending, Timestamp now) = 0;
  // The command ended: its status holds the one outcome. It has left the queue.
  virtual void OnEnd(PendingCommand pending, Timestamp now) = 0;
};

// The commands of one device: one at a time, in order. Free of I/O. The messages in between may be lost, doubled or
// reordered: a command is repeated to its driver under one id until the driver answers, and is asked about then.
class DeviceQueue {
 public:
  static constexpr std::size_t kMaxWaiting = 32;             // commands
  static constexpr MonoNs kRepeat = 20 * kMillisecond;       // until acknowledged
  static constexpr MonoNs kSlowRepeat = 200 * kMillisecond;  // after a second without
  static constexpr MonoNs kAsk = 250 * kMillisecond;         // a driver that works on it
  static constexpr MonoNs kSilentAfter = 5 * kSecond;        // a routed command without a word: INDETERMINATE
  static constexpr MonoNs kOvertaken = 50 * kMillisecond;    // a command that waits for the journal: reads pass it

  DeviceQueue(const DriverLink& driver, DeviceQueueListener& output) : driver_(driver), output_(output) {}

  [[nodiscard]] bool IsFull() const { return waiting_.size() >= kMaxWaiting; }
  void Push(PendingCommand pending) { waiting_.push_back(std::move(pending)); }
  void PushFirst(PendingCommand pending);
  [[nodiscard]] bool IsIdle() const { return !current_ && waiting_.empty(); }
  // A command that an earlier bridge had routed: before any other, its driver is asked what became of it.
  void PushRecovered(PendingCommand pending);

  // Who gave a command that is here and has no outcome yet.
  [[nodiscard]] std::optional<std::string> SenderOf(const CommandId& id);
  [[nodiscard]] bool Holds(PendingCommand::Purpose purpose) const;

  // The journal has noted (`written`), or cannot note, what this command waits for. Nothing happens when it waits no
  // more.
  void OnJournalled(const CommandId& id, PendingCommand::JournalState what, bool written, const Error& not_written,
                    Timestamp now);
  // The acceptance of this command is being written.
  [[nodiscard]] bool IsAwaitingAcceptance(const CommandId& id);
  // Takes out a command whose acceptance is being written.
  [[nodiscard]] std::optional<PendingCommand> Withdraw(const CommandId& id);

  // Ends a waiting command as CANCELLED. Asks the driver to give up a command that this bridge or an earlier one has routed.
  // Returns false if the command is not in the queue.
  bool Cancel(const CommandId& id, Timestamp now);
  // A status from the driver's boot `status.boot_id` that DriverLink let pass.
  void OnStatus(const driver_status_t& status, Timestamp now);
  void Tick(Timestamp now);

 private:
  void DropWaiting(Timestamp now);
  void RouteNext(Timestamp now);
  using Place = std::deque<PendingCommand>::iterator;
  [[nodiscard]] Place Waiting(const CommandId& id, std::optional<PendingCommand::JournalState> state = {});
  [[nodiscard]] Place Next(Timestamp now);
  [[nodiscard]] PendingCommand Take(Place pending);
  void Route(PendingCommand pending, Timestamp now);
  void Follow(Timestamp now);
  void SendDue(PendingCommand& pending, Timestamp now);
  void OnUnknown(const driver_status_t& status, Timestamp now);
  void OnDriverLost(std::int32_t reason, const std::string& text, Timestamp now);
  void End(PendingCommand pending, std::int8_t state, std::int32_t reason, const std::string& text, Timestamp now);
  PendingCommand TakeCurrent();

  const DriverLink& driver_;
  DeviceQueueListener& output_;
  std::deque<PendingCommand> waiting_;
  std::optional<PendingCommand> current_;
};

}  // namespace axlecast
