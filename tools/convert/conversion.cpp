#include "tools/convert/conversion.h"

#include <algorithm>
#include <optional>

#include "core/messages/json/message_json.h"

namespace axlecast {

std::int64_t SampleTime(const LogEvent& event) {
  constexpr std::int64_t kYear10000 = 253'402'300'800'000'000;
  const std::int64_t received = std::clamp(event.utime, std::int64_t{0}, kYear10000 - 1);
  const std::optional<MessageHead> head = HeadOf(event.data);
  const std::int64_t utime = head ? head->utime : -1;
  return utime >= 0 && utime < kYear10000 ? utime : received;
}

}  // namespace axlecast
