#include "bridge/store/device_store.h"

namespace axlecast {

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
