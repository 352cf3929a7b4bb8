#include "drivers/runtime/bus/wire_reader.h"

#include <cstddef>
#include <optional>

namespace axlecast {
namespace {

Interval IntervalOf(const wire_t& message, const wire_record_t& record) {
  const MonoNs first = message.mono_ns + record.dt_ns;
  return {first, first + record.duration_ns};
}

std::optional<Event::Kind> KindOf(const wire_record_t& record, bool answers, bool can) {
  switch (record.direction) {
    case wire_record_t::DIRECTION_TRANSMIT:
      return Event::Kind::kSent;
    case wire_record_t::DIRECTION_CONFIRMED:
      return Event::Kind::kConfirmed;
    case wire_record_t::DIRECTION_NOT_SENT:
      return Event::Kind::kNotSent;
    case wire_record_t::DIRECTION_RECEIVE:
      if (can) return Event::Kind::kFrame;
      if (!answers) return Event::Kind::kUnsolicited;
      return (record.flags & wire_record_t::FLAG_TIMEOUT) != 0 ? Event::Kind::kTimeout : Event::Kind::kReply;
    case wire_record_t::DIRECTION_STRAY:
      return Event::Kind::kUnexpectedBytes;
    case wire_record_t::DIRECTION_SILENT:
      return Event::Kind::kSilent;
    case wire_record_t::DIRECTION_LINK_UP:
      return Event::Kind::kLinkUp;
    case wire_record_t::DIRECTION_LINK_DOWN:
      return Event::Kind::kLinkDown;
    case wire_record_t::DIRECTION_PULSE:
      return Event::Kind::kPulsed;
    case wire_record_t::DIRECTION_RETUNED:
      return Event::Kind::kBaudRateSet;
    default:
      return std::nullopt;
  }
}

// Whose step the record ends: an SPI bus has one device.
int DeviceOf(const wire_t& message, const wire_record_t& record, Event::Kind kind) {
  if (Event::IsOfBus(kind)) return -1;
  return message.kind == wire_t::KIND_SPI ? 0 : record.id;
}

}  // namespace

void WireReader::Read(const wire_t& message, const Sink& sink) {
  Follow(message);
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

void WireReader::Follow(const wire_t& message) {
  if (message.boot_id == boot_id_ && next_seq_ >= 0 && message.seq > next_seq_) {
    lost_messages_ += message.seq - next_seq_;
  }
  boot_id_ = message.boot_id;
  next_seq_ = message.seq + 1;
}

}  // namespace axlecast
