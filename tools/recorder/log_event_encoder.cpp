#include "tools/recorder/log_event_encoder.h"

namespace axlecast {

void LogEventEncoder::Write(const LoggedMessage& message) {
  record_.clear();
  AppendEvent(record_, {number_, message.utime, message.channel, message.data});
  ++number_;
  bytes_ += record_.size();
}

Bytes LogEventEncoder::Add(const LoggedMessage& message) {
  Write(message);
  open_.Add(record_);
  return record_;
}

Bytes LogEventEncoder::Seal(std::int64_t utime) {
  if (open_.seal().events == 0) return {};
  const std::vector<std::uint8_t> seal = EncodeSeal(open_.seal());
  open_.Reset();
  Write({utime, kSealChannel, seal});
  return record_;
}

}  // namespace axlecast
