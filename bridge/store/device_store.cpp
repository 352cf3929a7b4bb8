#include "bridge/store/device_store.h"

#include <algorithm>
#include <type_traits>

namespace axlecast {

bool Alters(const DeviceChange& change, const AxisRecord& record) {
  if (const auto* reference = std::get_if<ReferenceChanged>(&change))
    return reference->lost != record.reference_lost;
  if (const auto* identity = std::get_if<IdentityChanged>(&change)) return identity->identity != record.identity;
  return true;
}

bool DropsPosition(const DeviceChange& change) {
  return std::holds_alternative<DatumVoided>(change) || std::holds_alternative<EncoderExchanged>(change);
}

void DeviceMemory::Load(const std::string& device, const DeviceRecords& store) {
  axes_[device] = store.Find(device);
  datums_[device] = store.Datums(device);
  for (const DatumRecord& datum : datums_[device]) newest_ = std::max(newest_, datum.number);
  for (const AlarmMark& mark : store.Marks(device)) marks_[{device, mark.kind, mark.alarm}] = mark;
}

AxisRecord DeviceMemory::Find(const std::string& device) const {
  const auto found = axes_.find(device);
  return found == axes_.end() ? AxisRecord{} : found->second;
}

void DeviceMemory::SetDatum(const std::string& device, const DatumRecord& datum) {
  auto& datums = datums_[device];
  DatumRecord& kept = *datums.insert(datums.begin(), datum);
  kept.number = ++newest_;
  kept.voided_utime = 0;
  kept.void_reason.clear();
  axes_[device].datum = kept;
}

void DeviceMemory::VoidDatum(const std::string& device, const DatumVoided& voided) {
  AxisRecord& axis = axes_[device];
  for (DatumRecord& datum : datums_[device]) {
    if (!axis.datum || datum.number != axis.datum->number) continue;
    datum.voided_utime = voided.utime;
    datum.void_reason = voided.why;
  }
  axis.datum.reset();
  axis.position.reset();
}

bool DeviceMemory::Apply(const std::string& device, const DeviceChange& change) {
  AxisRecord& axis = axes_[device];
  const auto apply = [&](const auto& one) {
    using Change = std::decay_t<decltype(one)>;
    if constexpr (std::is_same_v<Change, DatumRecord>) {
      SetDatum(device, one);
    } else if constexpr (std::is_same_v<Change, DatumVoided>) {
      VoidDatum(device, one);
    } else if constexpr (std::is_same_v<Change, WritesAdded>) {
      axis.writes = std::max<std::int64_t>(axis.writes + one.writes, 0);
      if (axis.since_utime == 0) axis.since_utime = one.utime;
    } else if constexpr (std::is_same_v<Change, ReferenceChanged>) {
      axis.reference_lost = one.lost;
    } else if constexpr (std::is_same_v<Change, IdentityChanged>) {
      axis.identity = one.identity;
    } else if constexpr (std::is_same_v<Change, EncoderExchanged>) {
      VoidDatum(device, {one.utime, kExchangedReason});
      axis = {.identity = one.identity, .since_utime = one.utime};
    } else if constexpr (std::is_same_v<Change, AlarmMark>) {
      marks_[{device, one.kind, one.alarm}] = one;
    } else {
      marks_.erase({device, one.kind, one.alarm});
    }
  };
  std::visit(apply, change);
  return true;
}

std::vector<DatumRecord> DeviceMemory::Datums(const std::string& device) const {
  const auto found = datums_.find(device);
  return found == datums_.end() ? std::vector<DatumRecord>{} : found->second;
}

std::vector<AlarmMark> DeviceMemory::Marks(const std::string& device) const {
  std::vector<AlarmMark> found;
  for (const auto& [key, mark] : marks_) {
    if (std::get<0>(key) == device) found.push_back(mark);
  }
  return found;
}

bool DeviceStore::Apply(const std::string& device, const DeviceChange& change) {
  if (!Alters(change, memory_.Find(device))) return true;
  if (queue_.IsFull() || !memory_.Apply(device, change)) return false;
  queue_.Keep([=](DurableStore& store) { return store.Apply(device, change); }, now_.mono);
  if (DropsPosition(change)) positions_.erase(device);
  return true;
}

void DeviceStore::KeepPosition(const std::string& device, const LastPosition& position) {
  memory_.KeepPosition(device, position);
  positions_[device] = position;
}

void DeviceStore::Note(const AxisEvent& event) {
  if (queue_.IsHalfFull()) return;
  queue_.Give([event](DurableStore& store) { return store.Note(event), true; }, nullptr, now_.mono);
}

}  // namespace axlecast
