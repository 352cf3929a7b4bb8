// Answers of a root that anybody may have sent: no instant in them makes a claim that contradicts itself.
#include <cstdint>
#include <cstdlib>
#include <span>

#include "core/time/time_keeper.h"
#include "core/time/time_packet.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace axlecast;
  TimeKeeper keeper({}, 0);
  MonoNs raw = kSecond;
  std::span<const std::uint8_t> bytes(data, size);
  while (bytes.size() >= kTimePacketBytes) {
    const auto packet = DecodedTimePacket(bytes.first(kTimePacketBytes));
    bytes = bytes.subspan(kTimePacketBytes);
    if (!packet) continue;
    raw += 100 * kMillisecond;
    static_cast<void>(
        keeper.OnExchange({raw - kMillisecond, raw, packet->asked, packet->answered}, packet->base_id));
    keeper.OnClocks({raw, raw, raw, raw + 50});
    time_quality_t quality{};
    keeper.Describe(quality);
    const bool claims = quality.grade == time_quality_t::GRADE_PROVEN;
    if (claims != (quality.half_width_ns >= 0) || claims != quality.reason.empty()) std::abort();
  }
  return 0;
}
