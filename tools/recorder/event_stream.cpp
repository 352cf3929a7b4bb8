#include "tools/recorder/event_stream.h"

namespace axlecast {

void EventStream::Write(const LoggedMessage& message) {
  record_.clear();
  AppendEvent(record_, {begin_.events, message.utime, message.channel, message.data});
  ++begin_.events;
  begin_.bytes += record_.size();
}

Bytes EventStream::Add(const LoggedMessage& message) {
  Write(message);
  LogSeal& unsealed = begin_.unsealed;
  unsealed.bytes += record_.size();
  ++unsealed.events;
  unsealed.crc32c = Crc32c(unsealed.crc32c, record_);
  return record_;
}

Bytes EventStream::Seal(std::int64_t utime) {
  if (begin_.unsealed.events == 0) return {};
  const std::vector<std::uint8_t> seal = EncodeSeal(begin_.unsealed);
  begin_.unsealed = {};
  Write({utime, kSealChannel, seal});
  return record_;
}

}  // namespace axlecast
