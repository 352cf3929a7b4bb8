#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <string>

namespace axlecast {

// The request "tracking" to chronyd and its reply (chrony 4.3, candm.h, protocol version 6; UDP 127.0.0.1:323, which any user may ask).
// Both have the same length, integers are big-endian, unused bytes are 0.
//
//   request  0  version 6   1  type 1   4  command 33   8  sequence
//   reply    0  version 6   1  type 2   4  command 33   6  reply 5   8  status 0   16  sequence   28  reference id   32  its address, 16
//           48  family   52  stratum   54  leap   56  reference time: high, low seconds, ns   68  correction   72  last offset
//           76  rms offset   80  frequency   84  residual frequency   88  skew   92  root delay   96  root dispersion   100  interval
inline constexpr std::size_t kChronyPacketBytes = 104;
inline constexpr int kChronyPort = 323;
using ChronyRequest = std::array<std::uint8_t, kChronyPacketBytes>;

// What chronyd states about UNIX time of its host.
struct ChronyTracking {
  static constexpr std::uint32_t kLocalReference = 0x7f7f0101;
  static constexpr int kNotSynchronised = 3;

  std::uint32_t reference_id = 0;  // 0: none
  std::string reference = {};      // its address; without one its name, as GPS or PPS
  int stratum = 0;
  int leap = 0;                       // kNotSynchronised: UNIX time is not synchronised
  std::int64_t reference_utc_ns = 0;  // UNIX time of the last update
  double correction_s = 0;            // still to be added to UNIX time
  double residual_frequency_ppm = 0;
  double skew_ppm = 0;  // error bound of the frequency
  double root_delay_s = 0;
  double root_dispersion_s = 0;

  // Returns true if chronyd follows a server or a reference clock, not only its own clock.
  [[nodiscard]] bool FollowsReference() const {
    return leap != kNotSynchronised && reference_id != 0 && reference_id != kLocalReference;
  }
};

// `sequence`: the reply repeats it.
[[nodiscard]] ChronyRequest TrackingRequest(std::uint32_t sequence);
// Returns nothing if the bytes are not a good reply to the request with this number, or contain impossible figures.
[[nodiscard]] std::optional<ChronyTracking> DecodedTracking(std::span<const std::uint8_t> bytes,
                                                            std::uint32_t sequence);

}  // namespace axlecast
