#pragma once

#include <algorithm>
#include <cstdint>
#include <map>
#include <string>
#include <tuple>
#include <vector>

#include "bridge/store/alarm_store.h"
#include "bridge/store/axis_store.h"

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

}  // namespace axlecast
