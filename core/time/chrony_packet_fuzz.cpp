// Any datagram on the port of chronyd: no crash, and a claim of it is never negative or without a grade.
#include <cstdint>
#include <cstdlib>
#include <span>
#include <vector>

#include "core/time/chrony_packet.h"
#include "core/time/utc_claim.h"

namespace {

void Check(std::span<const std::uint8_t> bytes) {
  using namespace axlecast;
  const auto tracking = DecodedTracking(bytes, 7);
  if (!tracking) return;
  if (tracking->skew_ppm < 0 || tracking->root_dispersion_s < 0) std::abort();
  for (const std::int64_t utc_ns : {std::int64_t{0}, tracking->reference_utc_ns, INT64_MAX}) {
    const UtcClaim claim = ClaimOfChrony(*tracking, utc_ns);
    const bool claims = claim.grade == time_quality_t::GRADE_CLAIMED;
    if (claims != (claim.half_width_ns >= 0) || claim.reference.size() > 40) std::abort();
    time_quality_t message{};
    DescribeUtc(claim, {.mono_before = 5, .utc_ns = utc_ns, .mono_after = 9}, message);
    if (claims != (message.utc_half_width_ns >= 0)) std::abort();
  }
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  Check({data, size});
  // The same with a good head, which few inputs have.
  std::vector<std::uint8_t> reply = {6, 2, 0, 0, 0, 33, 0, 5, 0, 0, 0, 0, 0, 0,
                                     0, 0, 0, 0, 0, 7,  0, 0, 0, 0, 0, 0, 0, 0};
  reply.insert(reply.end(), data, data + size);
  reply.resize(axlecast::kChronyPacketBytes);
  Check(reply);
  return 0;
}
