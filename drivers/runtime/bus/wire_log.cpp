#include "drivers/runtime/bus/wire_log.h"

#include <algorithm>
#include <limits>

namespace axlecast {
namespace {

constexpr std::size_t kRecordBytes = 16;   // of a record without data
constexpr std::size_t kMessageBytes = 72;  // of a message without records and without the bus's name
constexpr std::size_t kMostRecords = (WireLog::kFlushBytes - kMessageBytes) / kRecordBytes;

bool FitsInt32(MonoNs value) {
  return value >= std::numeric_limits<std::int32_t>::min() && value <= std::numeric_limits<std::int32_t>::max();
}

bool IsExchange(const Event& event) {
  return event.kind == Event::Kind::kReply || event.kind == Event::Kind::kTimeout;
}

std::int8_t DirectionOf(Event::Kind kind) {
  switch (kind) {
    case Event::Kind::kStray:
      return wire_record_t::DIRECTION_STRAY;
    case Event::Kind::kSilent:
      return wire_record_t::DIRECTION_SILENT;
    case Event::Kind::kLinkUp:
      return wire_record_t::DIRECTION_LINK_UP;
    case Event::Kind::kLinkDown:
      return wire_record_t::DIRECTION_LINK_DOWN;
    default:
      return wire_record_t::DIRECTION_RECEIVE;
  }
}

}  // namespace

WireLog::WireLog(const std::string& bus, std::int64_t boot_id, const Timebase& time, MessageSink& sink)
    : time_(time), sink_(sink), channel_("WIRE/" + bus), message_{} {
  message_.boot_id = boot_id;
  message_.bus = bus;
  message_.kind = wire_t::KIND_SERIAL;
  message_.records.resize(kMostRecords);
  for (wire_record_t& record : message_.records) record.data.resize(kMaxFrame);
}

void WireLog::Record(const Event& event) {
  const MonoNs first = IsExchange(event) ? event.sent.first : event.received.first;
  const std::size_t more = IsExchange(event) ? 2 * kRecordBytes + event.request.size() + event.bytes.size()
                                             : kRecordBytes + event.bytes.size();
  if (message_.n > 0 && (size_ + more > kFlushBytes || first >= due_)) Flush();
  if (message_.n == 0) {
    message_.mono_ns = first;
    size_ = kMessageBytes + message_.bus.size();
    due_ = first + kFlushAfter;
  }
  const std::int8_t flags = event.kind == Event::Kind::kTimeout ? wire_record_t::FLAG_TIMEOUT : std::int8_t{0};
  const std::int16_t before = message_.n;
  if (IsExchange(event) && !Add(event.sent, wire_record_t::DIRECTION_TRANSMIT, 0, event.request)) return;
  if (!Add(event.received, DirectionOf(event.kind), flags, event.bytes)) message_.n = before;
}

// False, and counted, when the instants cannot be written in the message's 32 bits.
bool WireLog::Add(Interval at, std::int8_t direction, std::int8_t flags, Bytes bytes) {
  const MonoNs after = at.first - message_.mono_ns;
  const MonoNs duration = at.last - at.first;
  if (!FitsInt32(after) || !FitsInt32(duration) || bytes.size() > kMaxFrame) {
    ++message_.dropped;
    return false;
  }
  wire_record_t& record = message_.records[static_cast<std::size_t>(message_.n++)];
  record.dt_ns = static_cast<std::int32_t>(after);
  record.duration_ns = static_cast<std::int32_t>(duration);
  record.direction = direction;
  record.flags = flags;
  record.len = static_cast<std::int16_t>(bytes.size());
  std::copy(bytes.begin(), bytes.end(), record.data.begin());
  size_ += kRecordBytes + bytes.size();
  return true;
}

void WireLog::Flush() {
  due_ = kNever;
  if (message_.n == 0) return;
  message_.utime = time_.Utime(message_.mono_ns);
  if (Publish(sink_, channel_, message_)) ++message_.seq;
  message_.n = 0;
}

}  // namespace axlecast
