#pragma once

#include <cstdint>
#include <map>
#include <string>
#include <tuple>
#include <utility>
#include <vector>

#include "bridge/store/durable_store.h"
#include "bridge/store/journal_queue.h"

namespace axlecast {

// Records of devices in memory, by the same rules as the journal's tables. Every change succeeds.
class DeviceMemory final : public DeviceRecords {
 public:
  // Copies all that `store` (the journal) holds of a device.
  void Load(const std::string& device, const DeviceRecords& store);

  [[nodiscard]] bool Apply(const std::string& device, const DeviceChange& change) override;
  void KeepPosition(const std::string& device, const LastPosition& position) override {
    axes_[device].position = position;
  }
  void Note(const AxisEvent& /*event*/) override {}
  [[nodiscard]] AxisRecord Find(const std::string& device) const override;
  [[nodiscard]] std::vector<DatumRecord> Datums(const std::string& device) const override;
  [[nodiscard]] std::vector<AlarmMark> Marks(const std::string& device) const override;

 private:
  void SetDatum(const std::string& device, const DatumRecord& datum);
  void VoidDatum(const std::string& device, const DatumVoided& voided);

  std::map<std::string, AxisRecord> axes_;
  std::map<std::string, std::vector<DatumRecord>> datums_;  // newest first
  std::int64_t newest_ = 0;                                 // number of the newest datum of all
  std::map<std::tuple<std::string, AlarmMark::Kind, std::string>, AlarmMark> marks_;
};

// Records of devices for the dispatcher, answered from memory and written by the journal's thread. Apply returns true if
// the change is kept and will be written, in order, as soon as possible. It returns false and changes nothing if too many
// changes wait already. What must be durable first waits for a later Give of the same queue.
class DeviceStore final : public DeviceRecords {
 public:
  // `now`: time of the present call; it must outlive the store, like `queue`.
  DeviceStore(JournalQueue& queue, const Timestamp& now) : queue_(queue), now_(now) {}

  void Load(DeviceMemory memory) { memory_ = std::move(memory); }
  // Returns the positions that were kept since the last call, to be written with the next Tick of the journal.
  [[nodiscard]] std::map<std::string, LastPosition> TakePositions() { return std::exchange(positions_, {}); }

  [[nodiscard]] bool Apply(const std::string& device, const DeviceChange& change) override;
  void KeepPosition(const std::string& device, const LastPosition& position) override;
  void Note(const AxisEvent& event) override;
  [[nodiscard]] AxisRecord Find(const std::string& device) const override { return memory_.Find(device); }
  [[nodiscard]] std::vector<DatumRecord> Datums(const std::string& device) const override {
    return memory_.Datums(device);
  }
  [[nodiscard]] std::vector<AlarmMark> Marks(const std::string& device) const override {
    return memory_.Marks(device);
  }

 private:
  JournalQueue& queue_;
  DeviceMemory memory_;
  std::map<std::string, LastPosition> positions_;
  const Timestamp& now_;
};

}  // namespace axlecast
