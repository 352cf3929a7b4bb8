// Whatever arrives, a filter takes it or refuses it, and its list of other machines stays bounded and believable.

#include <cstddef>
#include <cstdint>

#include "core/messages/machine_filter.h"
#include "core/messages/origin.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  static axlecast::MachineFilter filter("press1");
  const axlecast::Bytes message(data, size);
  if (filter.Takes(message)) return 0;
  filter.Refuse(message, axlecast::kSecond);
  const auto others = filter.Others(axlecast::kSecond);
  if (others.empty() || others.size() > axlecast::MachineFilter::kMaxOthers) __builtin_trap();
  for (const axlecast::OtherMachine& other : others) {
    if (!other.name.empty() && axlecast::NameHash(other.name) != other.id) __builtin_trap();
  }
  return 0;
}
