#include "bridge/store/device_store.h"

namespace axlecast {

AxisRecord DeviceMemory::Find(const std::string& device) const {
  const auto found = axes_.find(device);
  return found == axes_.end() ? AxisRecord{} : found->second;
}

bool DeviceMemory::SetDatum(const std::string& device, const DatumRecord& datum) {
  auto& datums = datums_[device];
  DatumRecord& kept = *datums.insert(datums.begin(), datum);
  kept.number = ++newest_;
  kept.voided_utime = 0;
  kept.void_reason.clear();
  axes_[device].datum = kept;
  return true;
}

bool DeviceMemory::VoidDatum(const std::string& device, std::int64_t utime, const std::string& why) {
  AxisRecord& axis = axes_[device];
  if (axis.datum) {
    for (DatumRecord& datum : datums_[device]) {
      if (datum.number != axis.datum->number) continue;
      datum.voided_utime = utime;
      datum.void_reason = why;
    }
  }
  axis.datum.reset();
  axis.position.reset();
  return true;
}

std::vector<DatumRecord> DeviceMemory::Datums(const std::string& device) const {
  const auto found = datums_.find(device);
  return found == datums_.end() ? std::vector<DatumRecord>{} : found->second;
}

bool DeviceMemory::AddWrites(const std::string& device, std::int64_t writes, std::int64_t utime) {
  AxisRecord& axis = axes_[device];
  axis.writes = std::max<std::int64_t>(axis.writes + writes, 0);
  if (axis.since_utime == 0) axis.since_utime = utime;
  return true;
}

bool DeviceMemory::SetReferenceLost(const std::string& device, bool lost) {
  axes_[device].reference_lost = lost;
  return true;
}

bool DeviceMemory::SetIdentity(const std::string& device, const std::string& identity) {
  axes_[device].identity = identity;
  return true;
}

bool DeviceMemory::Exchange(const std::string& device, const std::string& identity, std::int64_t utime) {
  static_cast<void>(VoidDatum(device, utime, "the encoder was exchanged"));
  AxisRecord axis;
  axis.identity = identity;
  axis.since_utime = utime;
  axes_[device] = axis;
  return true;
}

void DeviceMemory::KeepPosition(const std::string& device, const LastPosition& position) {
  axes_[device].position = position;
}

bool DeviceMemory::SetMark(const std::string& device, const AlarmMark& mark) {
  marks_[{device, mark.kind, mark.alarm}] = mark;
  return true;
}

bool DeviceMemory::EndMark(const std::string& device, AlarmMark::Kind kind, const std::string& alarm) {
  marks_.erase({device, kind, alarm});
  return true;
}

std::vector<AlarmMark> DeviceMemory::Marks(const std::string& device) const {
  std::vector<AlarmMark> found;
  for (const auto& [key, mark] : marks_) {
    if (std::get<0>(key) == device) found.push_back(mark);
  }
  return found;
}

template <typename Change>
bool DeviceStore::Both(Change change) {
  if (queue_.IsFull() || !change(memory_)) return false;
  queue_.Keep([change](DurableStore& store) { return change(store); }, now_);
  return true;
}

bool DeviceStore::SetDatum(const std::string& device, const DatumRecord& datum) {
  return Both([=](auto& store) { return store.SetDatum(device, datum); });
}

bool DeviceStore::VoidDatum(const std::string& device, std::int64_t utime, const std::string& why) {
  if (!Both([=](auto& store) { return store.VoidDatum(device, utime, why); })) return false;
  positions_.erase(device);
  return true;
}

bool DeviceStore::AddWrites(const std::string& device, std::int64_t writes, std::int64_t utime) {
  return Both([=](auto& store) { return store.AddWrites(device, writes, utime); });
}

bool DeviceStore::SetReferenceLost(const std::string& device, bool lost) {
  if (memory_.Find(device).reference_lost == lost) return true;
  return Both([=](auto& store) { return store.SetReferenceLost(device, lost); });
}

bool DeviceStore::SetIdentity(const std::string& device, const std::string& identity) {
  if (memory_.Find(device).identity == identity) return true;
  return Both([=](auto& store) { return store.SetIdentity(device, identity); });
}

bool DeviceStore::Exchange(const std::string& device, const std::string& identity, std::int64_t utime) {
  if (!Both([=](auto& store) { return store.Exchange(device, identity, utime); })) return false;
  positions_.erase(device);
  return true;
}

void DeviceStore::KeepPosition(const std::string& device, const LastPosition& position) {
  memory_.KeepPosition(device, position);
  positions_[device] = position;
}

void DeviceStore::Note(const AxisEvent& event) {
  if (queue_.IsHalfFull()) return;
  queue_.Give([event](DurableStore& store) { return store.Note(event), true; }, nullptr, now_);
}

bool DeviceStore::SetMark(const std::string& device, const AlarmMark& mark) {
  return Both([=](auto& store) { return store.SetMark(device, mark); });
}

bool DeviceStore::EndMark(const std::string& device, AlarmMark::Kind kind, const std::string& alarm) {
  return Both([=](auto& store) { return store.EndMark(device, kind, alarm); });
}

}  // namespace axlecast
