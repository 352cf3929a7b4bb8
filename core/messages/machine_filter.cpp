#include "core/messages/machine_filter.h"

#include <algorithm>
#include <array>

#include "core/base/spelling.h"
#include "core/base/text.h"
#include "core/messages/json/published_types.h"
#include "core/messages/message.h"
#include "core/messages/origin.h"

namespace axlecast {
namespace {

constexpr std::size_t kMachineAt = 40;  // behind fingerprint, utime, mono_ns, boot_id and seq

template <typename... Messages>
bool IsOneOf(TypeList<Messages...>, std::int64_t fingerprint) {
  static const std::array<std::int64_t, sizeof...(Messages)> kAll = {Messages::getHash()...};
  return std::find(kAll.begin(), kAll.end(), fingerprint) != kAll.end();
}

bool IsOfAxlecast(std::int64_t fingerprint) { return IsOneOf(PublishedTypes{}, fingerprint); }

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

template <typename... Messages>
void ReadNameOf(TypeList<Messages...>, Bytes message, std::string& name) {
  static_cast<void>((ReadName<Messages>(message, name) || ...));
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
  ReadNameOf(NamedTypes{}, message, other->name);
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
