#include "tools/convert/sample_time.h"

#include "tools/json/field.h"
#include "tools/json/message_json.h"

namespace axlecast {

std::int64_t SampleTime(const LogEvent& event) {
  constexpr std::size_t kFingerprint = 8;
  const MessageType* const type = FindMessageType(event.data);
  if (type == nullptr || !type->begins_with_utime) return event.utime;
  return BigEndian64(event.data.subspan(kFingerprint)).value_or(event.utime);
}

}  // namespace axlecast
