#include "tools/convert/sample_time.h"

#include <algorithm>

#include "tools/json/field.h"
#include "tools/json/message_json.h"

namespace axlecast {

std::int64_t SampleTime(const LogEvent& event) {
  constexpr std::size_t kFingerprint = 8;
  constexpr std::int64_t kYear10000 = 253'402'300'800'000'000;
  const std::int64_t received = std::clamp(event.utime, std::int64_t{0}, kYear10000 - 1);
  const MessageType* const type = FindMessageType(event.data);
  if (type == nullptr || !type->begins_with_utime) return received;
  const std::int64_t utime = BigEndian64(event.data.subspan(kFingerprint)).value_or(-1);
  return utime >= 0 && utime < kYear10000 ? utime : received;
}

}  // namespace axlecast
