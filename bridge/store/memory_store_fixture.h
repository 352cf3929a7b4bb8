#pragma once

#include <algorithm>
#include <cstddef>
#include <deque>
#include <map>
#include <string>
#include <utility>
#include <vector>

#include "bridge/store/durable_store.h"
#include "bridge/store/journal_queue.h"
#include "core/command/commands.h"
#include "core/messages/enum_names.h"

namespace axlecast {

// For tests: a store that outlives bridges as a disk does, and fails on request.
class MemoryStore : public DurableStore {
 public:
  bool fails = false;
  bool is_full = false;    // it can be read, and reserves no epochs
  mutable int opened = 0;  // how often what is open was read
  int reserved = 0;        // how often epochs were reserved, also in vain
  int ticks = 0;
  int steps = 0;  // how often a step was written
  std::vector<AxisEvent> events;
  DeviceMemory devices;

  // As when the file is replaced by an older one, or an empty one.
  void LoseCommands() {
    commands_.clear();
    order_.clear();
  }

  bool Accepted(const CommandRecord& record, Timestamp) override {
    if (fails) return false;
    const CommandId id = IdOf(record.status.id);
    if (!commands_.emplace(id, OpenCommand{record, 0}).second) return false;
    order_.push_back(id);
    return true;
  }
  bool Routed(const command_status_t& status, std::int64_t epoch, Timestamp) override {
    if (fails) return false;
    const auto found = commands_.find(IdOf(status.id));
    if (found != commands_.end()) found->second = {WithStatus(status), epoch};
    return found != commands_.end();
  }
  void Step(const command_status_t& status, Timestamp) override {
    ++steps;
    Put(status);
  }
  void Outcome(const command_status_t& status, Timestamp) override { Put(status); }
  std::optional<command_status_t> Find(const CommandId& id) const override {
    const auto found = commands_.find(id);
    return found == commands_.end() ? std::nullopt : std::optional(found->second.record.status);
  }

  bool Apply(const std::string& device, const DeviceChange& change) override {
    return !fails && devices.Apply(device, change);
  }
  void KeepPosition(const std::string& device, const LastPosition& position) override {
    devices.KeepPosition(device, position);
  }
  void Note(const AxisEvent& event) override { events.push_back(event); }
  AxisRecord Find(const std::string& device) const override { return devices.Find(device); }
  std::vector<DatumRecord> Datums(const std::string& device) const override { return devices.Datums(device); }
  std::vector<AlarmMark> Marks(const std::string& device) const override { return devices.Marks(device); }

  std::vector<OpenCommand> Open() const override {
    ++opened;
    std::vector<OpenCommand> open;
    if (fails) return open;
    for (const CommandId& id : order_) {
      const command_status_t& status = commands_.at(id).record.status;
      const bool unfound =
          status.state == command_status_t::STATE_INDETERMINATE && status.finding == command_status_t::FINDING_NONE;
      if (!IsFinalState(status.state) || unfound) open.push_back(commands_.at(id));
    }
    return open;
  }
  std::int64_t ReserveEpochs(std::int64_t at_least, std::int64_t count) override {
    ++reserved;
    if (fails || is_full) return 0;
    const std::int64_t first = std::max(at_least, reserved_);
    reserved_ = first + count;
    return first;
  }
  void Tick(Timestamp) override { ++ticks; }
  bool readable() const override { return !fails; }
  Result<> state() const override { return fails || is_full ? Result<>(Failure("the disk is full")) : Result<>(); }

 private:
  CommandRecord WithStatus(const command_status_t& status) {
    CommandRecord record = commands_.at(IdOf(status.id)).record;
    record.status = status;
    return record;
  }
  void Put(const command_status_t& status) {
    const auto found = commands_.find(IdOf(status.id));
    if (found != commands_.end()) found->second.record.status = status;
  }

  std::map<CommandId, OpenCommand> commands_;
  std::vector<CommandId> order_;
  std::int64_t reserved_ = 0;
};

// For tests: runs work in the caller's thread, at once, or when the test allows it: a disk that has stalled.
class InlineJournal final : public JournalWorker {
 public:
  explicit InlineJournal(DurableStore& store) : store_(store) {}

  void Run(Work work) override {
    waiting_.push_back(std::move(work));
    if (!stalled_) RunWaiting();
  }
  std::size_t TakeFinished() override { return std::exchange(finished_, 0); }

  // From now on nothing is run.
  void Stall() { stalled_ = true; }
  // Runs what waits, and everything from now on at once.
  void Recover() {
    stalled_ = false;
    RunWaiting();
  }
  [[nodiscard]] std::size_t waiting() const { return waiting_.size(); }

 private:
  void RunWaiting() {
    while (!waiting_.empty()) {
      const Work work = std::move(waiting_.front());
      waiting_.pop_front();
      work(store_);
      ++finished_;
    }
  }

  DurableStore& store_;
  std::deque<Work> waiting_;
  std::size_t finished_ = 0;
  bool stalled_ = false;
};

}  // namespace axlecast
