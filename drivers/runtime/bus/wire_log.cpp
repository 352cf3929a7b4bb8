#include "drivers/runtime/bus/wire_log.h"

#include <algorithm>
#include <limits>
#include <optional>

namespace axlecast {
namespace {

constexpr std::size_t kRecordBytes = 16;   // of a record without data
constexpr std::size_t kMessageBytes = 72;  // of a message without records and without the name of the bus
// Of a frame that contains a secret, only address and function are recorded, because its checksum would help to guess the
// secret. Of bytes that are not a frame, nothing is recorded: they may begin anywhere in the frame.
constexpr std::size_t kShown = 2;
constexpr std::size_t kMaxRecords = (WireLog::kFlushBytes - kMessageBytes) / kRecordBytes;

bool FitsInt32(MonoNs value) {
  return value >= std::numeric_limits<std::int32_t>::min() && value <= std::numeric_limits<std::int32_t>::max();
}

bool IsExchange(const Event& event) {
  return event.kind == Event::Kind::kReply || event.kind == Event::Kind::kTimeout;
}

// The direction of the record for each kind of event. Further kinds are recorded as DIRECTION_RECEIVE.
struct DirectionOfKind {
  Event::Kind kind;
  std::int8_t direction;
};
constexpr DirectionOfKind kDirections[] = {
    {Event::Kind::kUnexpectedBytes, wire_record_t::DIRECTION_STRAY},
    {Event::Kind::kSilent, wire_record_t::DIRECTION_SILENT},
    {Event::Kind::kLinkUp, wire_record_t::DIRECTION_LINK_UP},
    {Event::Kind::kLinkDown, wire_record_t::DIRECTION_LINK_DOWN},
    {Event::Kind::kPulsed, wire_record_t::DIRECTION_PULSE},
    {Event::Kind::kBaudRateSet, wire_record_t::DIRECTION_RETUNED},
    {Event::Kind::kSent, wire_record_t::DIRECTION_TRANSMIT},
    {Event::Kind::kConfirmed, wire_record_t::DIRECTION_CONFIRMED},
    {Event::Kind::kNotSent, wire_record_t::DIRECTION_NOT_SENT},
};

std::int8_t DirectionOf(Event::Kind kind) {
  const auto* const found = std::ranges::find(kDirections, kind, &DirectionOfKind::kind);
  return found == std::end(kDirections) ? wire_record_t::DIRECTION_RECEIVE : found->direction;
}

std::int8_t FlagsOf(const Event& event, std::int8_t direction) {
  const bool timed_out = event.kind == Event::Kind::kTimeout && direction == wire_record_t::DIRECTION_RECEIVE;
  return static_cast<std::int8_t>((event.secret ? wire_record_t::FLAG_REDACTED : 0) |
                                  (timed_out ? wire_record_t::FLAG_TIMEOUT : 0));
}

Interval IntervalOf(const wire_t& message, const wire_record_t& record) {
  const MonoNs first = message.mono_ns + record.dt_ns;
  return {first, first + record.duration_ns};
}

std::optional<Event::Kind> KindOf(const wire_record_t& record, bool answers, bool can) {
  if (record.direction == wire_record_t::DIRECTION_RECEIVE) {
    if (can) return Event::Kind::kFrame;
    if (!answers) return Event::Kind::kUnsolicited;
    return (record.flags & wire_record_t::FLAG_TIMEOUT) != 0 ? Event::Kind::kTimeout : Event::Kind::kReply;
  }
  const auto* const found = std::ranges::find(kDirections, record.direction, &DirectionOfKind::direction);
  return found == std::end(kDirections) ? std::nullopt : std::optional(found->kind);
}

// Returns the device whose step the record ends. An SPI bus has one device.
int DeviceOf(const wire_t& message, const wire_record_t& record, Event::Kind kind) {
  if (Event::IsOfBus(kind)) return -1;
  return message.kind == wire_t::KIND_SPI ? 0 : record.id;
}

}  // namespace

WireLog::WireLog(const std::string& bus, const Origin& origin, const Timebase& time, MessageSink& sink, Kind kind)
    : time_(time), sink_(sink), kind_(kind), channel_("WIRE/" + bus), message_{} {
  origin.Set(message_);
  message_.bus = bus;
  message_.kind = kind.kind;
  message_.records.resize(kMaxRecords);
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
  const std::int16_t before = message_.n;
  if (IsExchange(event) && !Add(event, event.sent, wire_record_t::DIRECTION_TRANSMIT, event.request)) return;
  if (!Add(event, event.received, DirectionOf(event.kind), event.bytes)) message_.n = before;
}

std::int32_t WireLog::IdOf(const Event& event) const {
  if (kind_.kind == wire_t::KIND_SPI) return kind_.clock_hz;
  return Event::IsFrame(event.kind) ? static_cast<std::int32_t>(event.id) : event.device;
}

// Returns false, and counts the event, if its timestamps do not fit the 32 bits of the message.
bool WireLog::Add(const Event& event, Interval at, std::int8_t direction, Bytes bytes) {
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
  record.flags = FlagsOf(event, direction);
  record.id = IdOf(event);
  record.len = static_cast<std::int16_t>(bytes.size());
  std::copy(bytes.begin(), bytes.end(), record.data.begin());
  if (event.secret) {
    const bool whole = direction == wire_record_t::DIRECTION_TRANSMIT || event.kind == Event::Kind::kReply;
    const std::size_t shown = whole ? std::min(kShown, bytes.size()) : 0;
    std::fill(record.data.begin() + static_cast<std::ptrdiff_t>(shown),
              record.data.begin() + static_cast<std::ptrdiff_t>(bytes.size()), std::uint8_t{0});
  }
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

void WireReader::Read(const wire_t& message, const Sink& sink) {
  const bool can = message.kind == wire_t::KIND_CAN;
  const wire_record_t* request = nullptr;
  for (const wire_record_t& record : message.records) {
    if (record.direction == wire_record_t::DIRECTION_TRANSMIT && !can) {
      if (request != nullptr) ++unreadable_;
      request = &record;
      continue;
    }
    const bool answers = request != nullptr && record.direction == wire_record_t::DIRECTION_RECEIVE;
    if (request != nullptr && !answers) ++unreadable_;
    if (const auto kind = KindOf(record, answers, can)) {
      sink({.kind = *kind,
            .sent = answers ? IntervalOf(message, *request) : Interval{},
            .received = IntervalOf(message, record),
            .request = answers ? Bytes(request->data) : Bytes(),
            .bytes = Bytes(record.data),
            .secret = (record.flags & wire_record_t::FLAG_REDACTED) != 0,
            .id = Event::IsFrame(*kind) ? static_cast<std::uint32_t>(record.id) : 0,
            .device = DeviceOf(message, record, *kind)});
    } else {
      ++unreadable_;
    }
    request = nullptr;
  }
  if (request != nullptr) ++unreadable_;
}

}  // namespace axlecast
