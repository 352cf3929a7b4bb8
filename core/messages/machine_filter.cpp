#include "core/messages/machine_filter.h"

#include <algorithm>
#include <array>
#include <axlecast/alarm_t.hpp>
#include <axlecast/bus_health_t.hpp>
#include <axlecast/command_status_t.hpp>
#include <axlecast/command_t.hpp>
#include <axlecast/device_info_t.hpp>
#include <axlecast/driver_command_t.hpp>
#include <axlecast/driver_status_t.hpp>
#include <axlecast/exchange_times_t.hpp>
#include <axlecast/motor_health_t.hpp>
#include <axlecast/motor_limits_t.hpp>
#include <axlecast/permit_t.hpp>
#include <axlecast/position_block_t.hpp>
#include <axlecast/position_t.hpp>
#include <axlecast/recorder_health_t.hpp>
#include <axlecast/trip_log_t.hpp>
#include <axlecast/wire_t.hpp>

#include "core/base/spelling.h"
#include "core/base/text.h"
#include "core/messages/message.h"
#include "core/messages/origin.h"

namespace axlecast {
namespace {

constexpr std::size_t kMachineAt = 40;  // behind fingerprint, utime, mono_ns, boot_id and seq

template <typename... Messages>
const auto& FingerprintsOf() {
  static const std::array<std::int64_t, sizeof...(Messages)> kAll = {Messages::getHash()...};
  return kAll;
}

bool IsOfAxlecast(std::int64_t fingerprint) {
  const auto& all =
      FingerprintsOf<position_t, alarm_t, bus_health_t, command_status_t, command_t, device_info_t,
                     driver_command_t, driver_status_t, exchange_times_t, motor_health_t, motor_limits_t, permit_t,
                     position_block_t, recorder_health_t, trip_log_t, wire_t>();
  return std::find(all.begin(), all.end(), fingerprint) != all.end();
}

// Returns the machine that a message states, or 0.
std::int64_t MachineOf(Bytes message) {
  if (message.size() < kMachineAt + sizeof(std::int64_t)) return 0;
  return ReadInt64(message, kMachineAt);
}

template <typename Message>
bool ReadName(Bytes message, std::string& name) {
  if (ReadInt64(message, 0) != Message::getHash()) return false;
  if (const auto decoded = DecodeMessage<Message>(message)) name = CappedText(decoded->machine, kNameBytes);
  return true;
}

}  // namespace

MachineFilter::MachineFilter(std::string_view machine) : own_(machine.empty() ? 0 : NameHash(machine)) {}

bool MachineFilter::Takes(Bytes message) const {
  if (own_ == 0) return true;
  const std::int64_t machine = MachineOf(message);
  return machine == own_ || machine == 0 || !IsOfAxlecast(ReadInt64(message, 0));
}

void MachineFilter::Refuse(Bytes message, MonoNs now) {
  const std::scoped_lock lock(mutex_);
  const std::int64_t id = MachineOf(message);
  auto other =
      std::find_if(others_.begin(), others_.end(), [id](const OtherMachine& each) { return each.id == id; });
  if (other == others_.end()) {
    std::erase_if(others_, [now](const OtherMachine& each) { return now - each.last > kPresent; });
    if (others_.size() == kMaxOthers) return;
    other = others_.insert(others_.end(), OtherMachine{.id = id});
  }
  ++other->messages;
  other->last = now;
  if (!other->name.empty()) return;
  static_cast<void>(ReadName<bus_health_t>(message, other->name) || ReadName<device_info_t>(message, other->name) ||
                    ReadName<driver_status_t>(message, other->name) ||
                    ReadName<recorder_health_t>(message, other->name));
  // A name that does not belong to the id is not believed.
  if (NameHash(other->name) != id) other->name.clear();
}

std::vector<OtherMachine> MachineFilter::Others(MonoNs now) const {
  const std::scoped_lock lock(mutex_);
  std::vector<OtherMachine> present;
  std::copy_if(others_.begin(), others_.end(), std::back_inserter(present),
               [now](const OtherMachine& each) { return now - each.last <= kPresent; });
  return present;
}

void AddMachine(std::vector<OtherMachine>& machines, const OtherMachine& machine) {
  const auto same = std::find_if(machines.begin(), machines.end(),
                                 [&machine](const OtherMachine& each) { return each.id == machine.id; });
  if (same == machines.end()) return machines.push_back(machine);
  same->messages += machine.messages;
  same->last = std::max(same->last, machine.last);
  if (same->name.empty()) same->name = machine.name;
}

std::string NamesOf(const std::vector<OtherMachine>& machines) {
  std::string names;
  for (const OtherMachine& machine : machines) {
    if (!names.empty()) names += ", ";
    names += machine.name.empty() ? Text("the machine with id %016llx", static_cast<unsigned long long>(machine.id))
                                  : "machine " + Quoted(machine.name);
  }
  return names;
}

}  // namespace axlecast
