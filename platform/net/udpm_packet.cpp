#include "platform/net/udpm_packet.h"

#include <algorithm>

namespace axlecast {
namespace {

constexpr std::uint32_t kShortMagic = 0x4c433032;     // "LC02"
constexpr std::uint32_t kFragmentMagic = 0x4c433033;  // "LC03"
constexpr std::size_t kShortHeader = 8;
constexpr std::size_t kFragmentHeader = 20;

std::uint32_t Read16(Bytes bytes, std::size_t at) {
  return static_cast<std::uint32_t>(bytes[at]) << 8 | bytes[at + 1];
}

std::uint32_t Read32(Bytes bytes, std::size_t at) { return Read16(bytes, at) << 16 | Read16(bytes, at + 2); }

// Takes the channel and its NUL off the front.
std::optional<std::string_view> TakeChannel(Bytes& rest) {
  const auto end = std::find(rest.begin(), rest.end(), std::uint8_t{0});
  const auto size = static_cast<std::size_t>(end - rest.begin());
  if (end == rest.end() || size == 0 || size > kLongestChannel) return std::nullopt;
  const std::string_view channel(reinterpret_cast<const char*>(rest.data()), size);
  rest = rest.subspan(size + 1);
  return channel;
}

std::optional<UdpmPacket> ParseShort(Bytes datagram) {
  ShortPacket packet;
  packet.sequence = Read32(datagram, 4);
  packet.payload = datagram.subspan(kShortHeader);
  const auto channel = TakeChannel(packet.payload);
  if (!channel) return std::nullopt;
  packet.channel = *channel;
  return packet;
}

// Every fragment but the first brings bytes, and none goes beyond the message.
bool IsConsistent(const FragmentPacket& packet) {
  if (packet.number >= packet.count || packet.size > kLargestMessage || packet.offset > packet.size) return false;
  if (packet.payload.size() > packet.size - packet.offset) return false;
  if (packet.number == 0) {
    return packet.offset == 0 && (packet.count == 1) == (packet.payload.size() == packet.size);
  }
  return !packet.payload.empty() && packet.count - std::uint64_t{1} <= packet.size;
}

std::optional<UdpmPacket> ParseFragment(Bytes datagram) {
  if (datagram.size() < kFragmentHeader) return std::nullopt;
  FragmentPacket packet;
  packet.sequence = Read32(datagram, 4);
  packet.size = Read32(datagram, 8);
  packet.offset = Read32(datagram, 12);
  packet.number = static_cast<std::uint16_t>(Read16(datagram, 16));
  packet.count = static_cast<std::uint16_t>(Read16(datagram, 18));
  packet.payload = datagram.subspan(kFragmentHeader);
  if (packet.number == 0) {
    const auto channel = TakeChannel(packet.payload);
    if (!channel) return std::nullopt;
    packet.channel = *channel;
  }
  if (!IsConsistent(packet)) return std::nullopt;
  return packet;
}

}  // namespace

std::optional<UdpmPacket> ParseUdpm(Bytes datagram) {
  if (datagram.size() < kShortHeader) return std::nullopt;
  switch (Read32(datagram, 0)) {
    case kShortMagic:
      return ParseShort(datagram);
    case kFragmentMagic:
      return ParseFragment(datagram);
    default:
      return std::nullopt;
  }
}

}  // namespace axlecast
