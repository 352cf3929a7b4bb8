// Datagrams of two senders at any times, out of any bytes: no crash, counts that are never negative, memory that is
// bounded, and no message larger than what came.
#include <algorithm>
#include <cstdlib>
#include <vector>

#include "platform/net/udpm_receiver.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  // Small enough for a few fragments to fill.
  constexpr axlecast::FragmentLimits kLimits = {.total = 4'096, .older = 1'024};
  axlecast::UdpmReceiver receiver(kLimits);
  axlecast::Bytes rest(data, size);
  axlecast::MonoNs now = 0;
  std::int64_t messages = 0;
  // Each: a byte of choices, a length, the datagram without its magic's first three bytes.
  while (rest.size() >= 2) {
    const std::uint8_t choice = rest[0];
    const std::size_t length = std::min<std::size_t>(rest[1], rest.size() - 2);
    std::vector<std::uint8_t> datagram = {'L', 'C', '0'};
    datagram.insert(datagram.end(), rest.begin() + 2, rest.begin() + 2 + static_cast<std::ptrdiff_t>(length));
    rest = rest.subspan(2 + length);
    now += (choice >> 1) * 20 * axlecast::kMillisecond;
    // Equal ports, of an IPv4 and an IPv6 address.
    axlecast::SenderAddress sender = axlecast::SenderAddress::OfIPv4(1, 7'667);
    if ((choice & 1) != 0) sender.address[0] = 0xfd;
    receiver.On({sender, now / axlecast::kMicrosecond, now, datagram},
                [&](const axlecast::ReceivedMessage& message) {
                  ++messages;
                  if (message.channel.empty() || message.data.size() > size) std::abort();
                });
    if (receiver.lost() < 0 || receiver.received() != messages) std::abort();
    if (receiver.fragment_memory() > kLimits.total) std::abort();
  }
  receiver.End();
  if (receiver.lost() < 0) std::abort();
  for (const axlecast::SenderCount& count : receiver.senders()) {
    if (count.lost < 0 || count.received < 0 || count.repeated < 0) std::abort();
  }
  return 0;
}
