#pragma once

#include <algorithm>
#include <cstdint>
#include <map>
#include <string>
#include <tuple>
#include <utility>
#include <vector>

#include "bridge/store/durable_store.h"
#include "bridge/store/journal_queue.h"

namespace axlecast {

// What the bridge keeps of its devices, in memory: the same rules as the journal's tables. Every change answers true.
class DeviceMemory final : public AxisStore, public AlarmStore {
 public:
  // Takes over all that `store` (the journal) holds of a device.
  template <typename Store>
  void Load(const std::string& device, const Store& store) {
    axes_[device] = store.Find(device);
    datums_[device] = store.Datums(device);
    for (const DatumRecord& datum : datums_[device]) newest_ = std::max(newest_, datum.number);
    for (const AlarmMark& mark : store.Marks(device)) marks_[{device, mark.kind, mark.alarm}] = mark;
  }

  [[nodiscard]] AxisRecord Find(const std::string& device) const override;
  [[nodiscard]] bool SetDatum(const std::string& device, const DatumRecord& datum) override;
  [[nodiscard]] bool VoidDatum(const std::string& device, std::int64_t utime, const std::string& why) override;
  [[nodiscard]] std::vector<DatumRecord> Datums(const std::string& device) const override;
  [[nodiscard]] bool AddWrites(const std::string& device, std::int64_t writes, std::int64_t utime) override;
  [[nodiscard]] bool SetReferenceLost(const std::string& device, bool lost) override;
  [[nodiscard]] bool SetIdentity(const std::string& device, const std::string& identity) override;
  [[nodiscard]] bool Exchange(const std::string& device, const std::string& identity, std::int64_t utime) override;
  void KeepPosition(const std::string& device, const LastPosition& position) override;
  void Note(const AxisEvent& /*event*/) override {}

  [[nodiscard]] bool SetMark(const std::string& device, const AlarmMark& mark) override;
  [[nodiscard]] bool EndMark(const std::string& device, AlarmMark::Kind kind, const std::string& alarm) override;
  [[nodiscard]] std::vector<AlarmMark> Marks(const std::string& device) const override;

 private:
  std::map<std::string, AxisRecord> axes_;
  std::map<std::string, std::vector<DatumRecord>> datums_;  // newest first
  std::int64_t newest_ = 0;                                 // number of the newest datum of all
  std::map<std::tuple<std::string, AlarmMark::Kind, std::string>, AlarmMark> marks_;
};

// What the bridge keeps of its devices, for the dispatcher: answered from memory, and written by the journal's thread.
// A change answers true when it is kept and will be written, in order, as soon as that works; false, and nothing is
// changed, when too much waits already. What must be durable first waits for a later Give of the same queue.
class DeviceStore final : public AxisStore, public AlarmStore {
 public:
  explicit DeviceStore(JournalQueue& queue) : queue_(queue) {}

  // What the journal holds.
  void Load(DeviceMemory memory) { memory_ = std::move(memory); }
  // Time of the changes that follow.
  void AdvanceTime(MonoNs now) { now_ = now; }
  // The last positions that were kept since the last call, to be written with the next Tick of the journal.
  [[nodiscard]] std::map<std::string, LastPosition> TakePositions() { return std::exchange(positions_, {}); }

  [[nodiscard]] AxisRecord Find(const std::string& device) const override { return memory_.Find(device); }
  [[nodiscard]] bool SetDatum(const std::string& device, const DatumRecord& datum) override;
  [[nodiscard]] bool VoidDatum(const std::string& device, std::int64_t utime, const std::string& why) override;
  [[nodiscard]] std::vector<DatumRecord> Datums(const std::string& device) const override {
    return memory_.Datums(device);
  }
  [[nodiscard]] bool AddWrites(const std::string& device, std::int64_t writes, std::int64_t utime) override;
  [[nodiscard]] bool SetReferenceLost(const std::string& device, bool lost) override;
  [[nodiscard]] bool SetIdentity(const std::string& device, const std::string& identity) override;
  [[nodiscard]] bool Exchange(const std::string& device, const std::string& identity, std::int64_t utime) override;
  void KeepPosition(const std::string& device, const LastPosition& position) override;
  void Note(const AxisEvent& event) override;

  [[nodiscard]] bool SetMark(const std::string& device, const AlarmMark& mark) override;
  [[nodiscard]] bool EndMark(const std::string& device, AlarmMark::Kind kind, const std::string& alarm) override;
  [[nodiscard]] std::vector<AlarmMark> Marks(const std::string& device) const override {
    return memory_.Marks(device);
  }

 private:
  // The same change to memory and journal. `change` takes a DeviceMemory or a DurableStore.
  template <typename Change>
  [[nodiscard]] bool Both(Change change);

  JournalQueue& queue_;
  DeviceMemory memory_;
  std::map<std::string, LastPosition> positions_;
  MonoNs now_ = 0;
};

}  // namespace axlecast
