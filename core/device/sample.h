#pragma once

#include <cstddef>
#include <cstdint>

#include "core/base/time.h"

namespace axlecast {

// Why a reading failed: index into device_info_t.errors, the values of its ERROR_* constants.
enum class ErrorKind : std::uint8_t {
  kTimeout,
  kShort,
  kFraming,
  kChecksum,
  kWrongEcho,
  kCommunicationAlarm,
  kAbnormalReply,
  kWrongIdentity,
  kRange,
  kImplausible,
  kDevice,
  kUnexpectedBytes,
  kBusy,
  kIo,
  kException,
  kSilent,
};
inline constexpr std::size_t kErrorKinds = 16;
[[nodiscard]] const char* ErrorName(ErrorKind kind);  // snake_case

// One decoded position as the device said it, before plausibility, direction and datum.
struct Sample {
  Interval at;                 // holds the sampling instant
  std::int64_t counts = 0;     // single-turn, [0, counts per turn)
  std::int32_t turns = 0;      // multi-turn counter as sent
  bool has_turns = false;      // this reply held the multi-turn counter
  bool turns_trusted = true;   // false: the device says that its turns may be wrong
  bool turns_wrapped = false;  // the counter has overflowed since it was last cleared
  bool low_accuracy = false;   // reduced resolution; the jump that ends it is exempt from plausibility
  bool error = false;          // the device says that the position is not valid
  bool warning = false;
  std::int32_t device_status = 0;  // raw
};

}  // namespace axlecast
