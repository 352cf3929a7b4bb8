#pragma once

#include <cstddef>
#include <cstdint>

#include "core/base/inline_bytes.h"

namespace axlecast::tformat {

// What the encoder makes of the bytes of one request. Written from Tables 1, 5 and 6 of the TS5669 N127
// specification on its own, sharing nothing with the codec: a mistake in one does not hide in the other.
struct SimulatedRequest {
  enum class Verdict : std::uint8_t {
    kIncomplete,  // more bytes must follow
    kNoSync,      // the first byte has a wrong sink code: no frame begins here
    kAbnormal,    // answered with data ID 3's data
    kGood,
  };
  Verdict verdict = Verdict::kIncomplete;
  std::size_t size = 0;       // bytes used
  std::uint8_t field = 0;     // the control field as received
  std::uint8_t data_id = 0;   // 0x0..0xF, its ID code
  bool parity_error = false;  // of the ID: communication alarm ca0
  std::uint8_t address = 0;   // of data ID 6 and D
  std::uint8_t data = 0;      // of data ID 6
};

// `complete`: no further byte follows, so that a request which is too short is abnormal. `bytes` is not empty.
[[nodiscard]] SimulatedRequest CheckRequest(Bytes bytes, bool complete);

// The control field of a data ID in Table 1.
[[nodiscard]] std::uint8_t TableControlField(std::uint8_t data_id);

}  // namespace axlecast::tformat
