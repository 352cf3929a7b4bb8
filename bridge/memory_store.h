#pragma once

#include <algorithm>
#include <map>
#include <string>
#include <tuple>
#include <vector>

#include "bridge/durable_store.h"
#include "drivers/runtime/command/command_words.h"
#include "drivers/runtime/command/order_ledger.h"

namespace axlecast {

// For tests: a store that outlives bridges as a disk does, and fails when it is told to.
class MemoryStore final : public DurableStore {
 public:
  bool fails = false;
  std::vector<AxisEvent> events;
  std::map<std::string, AxisRecord> axes;

  bool Accepted(const CommandRecord& record, Instant) override {
    if (fails) return false;
    const CommandId id = IdOf(record.status.id);
    if (!commands_.emplace(id, OpenCommand{record, 0}).second) return false;
    order_.push_back(id);
    return true;
  }
  bool Routed(const command_status_t& status, std::int64_t epoch, Instant) override {
    if (fails) return false;
    commands_.at(IdOf(status.id)) = {WithStatus(status), epoch};
    return true;
  }
  void Step(const command_status_t& status, Instant) override { Put(status); }
  void Outcome(const command_status_t& status, Instant) override { Put(status); }
  std::optional<command_status_t> Find(const CommandId& id) const override {
    const auto found = commands_.find(id);
    return found == commands_.end() ? std::nullopt : std::optional(found->second.record.status);
  }

  AxisRecord Find(const std::string& device) const override {
    const auto found = axes.find(device);
    return found == axes.end() ? AxisRecord{} : found->second;
  }
  bool SetDatum(const std::string& device, const DatumRecord& datum) override {
    if (fails) return false;
    auto& datums = datums_[device];
    datums.insert(datums.begin(), datum);
    datums.front().number = static_cast<std::int64_t>(datums.size());
    datums.front().voided_utime = 0;
    datums.front().void_reason.clear();
    axes[device].datum = datums.front();
    return true;
  }
  bool VoidDatum(const std::string& device, std::int64_t utime, const std::string& why) override {
    if (fails) return false;
    AxisRecord& axis = axes[device];
    if (axis.datum) {
      datums_[device].front().voided_utime = utime;
      datums_[device].front().void_reason = why;
    }
    axis.datum.reset();
    axis.position.reset();
    return true;
  }
  std::vector<DatumRecord> Datums(const std::string& device) const override {
    const auto found = datums_.find(device);
    return found == datums_.end() ? std::vector<DatumRecord>{} : found->second;
  }
  bool AddWrites(const std::string& device, std::int64_t writes, std::int64_t) override {
    if (fails) return false;
    axes[device].writes += writes;
    return true;
  }
  bool SetReferenceLost(const std::string& device, bool lost) override {
    axes[device].reference_lost = lost;
    return true;
  }
  bool SetIdentity(const std::string& device, const std::string& identity) override {
    axes[device].identity = identity;
    return true;
  }
  bool Exchange(const std::string& device, const std::string& identity, std::int64_t utime) override {
    if (fails || !VoidDatum(device, utime, "exchanged")) return false;
    AxisRecord axis;
    axis.identity = identity;
    axis.since_utime = utime;
    axes[device] = axis;
    return true;
  }
  void KeepPosition(const std::string& device, const LastPosition& position) override {
    axes[device].position = position;
  }
  void Note(const AxisEvent& event) override { events.push_back(event); }

  bool SetMark(const std::string& device, const AlarmMark& mark) override {
    if (fails) return false;
    marks_[{device, mark.kind, mark.alarm}] = mark;
    return true;
  }
  bool EndMark(const std::string& device, AlarmMark::Kind kind, const std::string& alarm) override {
    if (fails) return false;
    marks_.erase({device, kind, alarm});
    return true;
  }
  std::vector<AlarmMark> Marks(const std::string& device) const override {
    std::vector<AlarmMark> found;
    for (const auto& [key, mark] : marks_) {
      if (std::get<0>(key) == device) found.push_back(mark);
    }
    return found;
  }

  std::vector<OpenCommand> Open() const override {
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
    if (fails) return 0;
    const std::int64_t first = std::max(at_least, reserved_);
    reserved_ = first + count;
    return first;
  }
  void Tick(Instant) override {}
  std::string problem() const override { return fails ? "the disk is full" : ""; }

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
  std::map<std::string, std::vector<DatumRecord>> datums_;
  std::map<std::tuple<std::string, AlarmMark::Kind, std::string>, AlarmMark> marks_;
  std::int64_t reserved_ = 0;
};

}  // namespace axlecast
