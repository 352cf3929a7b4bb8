// Any datagram: the parser must not crash, and what it gives must lie within the datagram and agree with itself.
#include <cstdlib>

#include "platform/net/udpm_receiver.h"

namespace {

bool LiesWithin(axlecast::Bytes part, axlecast::Bytes whole) {
  return part.empty() || (part.data() >= whole.data() && part.data() + part.size() <= whole.data() + whole.size());
}

bool IsGood(const axlecast::ShortPacket& packet, axlecast::Bytes datagram) {
  return LiesWithin(packet.payload, datagram) && !packet.channel.empty() &&
         packet.channel.size() + packet.payload.size() + 9 == datagram.size();
}

bool IsGood(const axlecast::FragmentPacket& packet, axlecast::Bytes datagram) {
  return LiesWithin(packet.payload, datagram) && packet.number < packet.count &&
         packet.channel.empty() == (packet.number != 0) &&
         std::uint64_t{packet.offset} + packet.payload.size() <= packet.size;
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const axlecast::Bytes datagram(data, size);
  if (const auto packet = axlecast::ParseUdpm(datagram)) {
    if (!std::visit([&](const auto& kind) { return IsGood(kind, datagram); }, *packet)) std::abort();
  }
  return 0;
}
