#include "drivers/saa_serial/reading.h"

#include <algorithm>

namespace axlecast::saa_serial {
namespace {

// Where the frame begins in what came; nothing when that cannot be told yet.
std::optional<std::size_t> FrameBegin(Bytes bytes) {
  for (std::size_t i = 0; i + 1 < bytes.size(); ++i) {
    if (bytes[i] == kFrameStart && bytes[i + 1] != kFrameStart) return i;
  }
  return std::nullopt;
}

template <std::size_t kSize>
std::size_t LengthOfReply(Bytes so_far) {
  const std::optional<std::size_t> begin = FrameBegin(so_far);
  return begin ? *begin + kSize : 0;
}

ErrorKind KindOf(ReplyError error) {
  switch (error) {
    case ReplyError::kShort:
      return ErrorKind::kShort;
    case ReplyError::kHeader:
      return ErrorKind::kWrongEcho;
    case ReplyError::kRange:
      return ErrorKind::kRange;
    default:
      return ErrorKind::kChecksum;
  }
}

MonoNs Characters(std::size_t count, MonoNs character) { return static_cast<MonoNs>(count) * character; }

// It samples after the request, or the falling edge, and before the first bit of its reply.
Interval PolledInstant(const Event& event, std::size_t frame_size, MonoNs character) {
  const MonoNs earliest = event.sent.first + Characters(event.request.size(), character);
  // The first read returned at least one byte, the last read all of them.
  const MonoNs latest =
      std::min(event.received.first - character, event.received.last - Characters(frame_size, character));
  return {earliest, std::max(earliest, latest)};
}

}  // namespace

ReplyLength LengthRule(int bits) {
  switch (DataBytes(bits)) {
    case 2:
      return &LengthOfReply<ReplySize(kLeastBits)>;
    case 3:
      return &LengthOfReply<ReplySize(24)>;
    default:
      return &LengthOfReply<ReplySize(kMostBits)>;
  }
}

PolledReading ReadReply(const Event& event, const Format& format, MonoNs character) {
  PolledReading polled;
  Reading& reading = polled.reading;
  reading.at = {event.sent.first, EndOf(event)};
  polled.may_be_late = event.kind == Event::Kind::kTimeout;
  if (event.bytes.empty()) {
    reading.error = ErrorKind::kTimeout;
    return polled;
  }
  const std::optional<std::size_t> begin = FrameBegin(event.bytes);
  const std::size_t size = ReplySize(format.bits);
  if (!begin) {
    reading.error = event.bytes.size() < size ? ErrorKind::kShort : ErrorKind::kChecksum;
    return polled;
  }
  polled.stray = *begin;
  const Bytes rest = event.bytes.subspan(*begin);
  const Reply reply = ParseReply(rest.first(std::min(rest.size(), size)), format);
  if (reply.error != ReplyError::kNone) {
    reading.error = KindOf(reply.error);
    return polled;
  }
  reading.counts = reply.counts;
  reading.at = PolledInstant(event, size, character);
  return polled;
}

Interval StreamedInstant(const StreamParser::Found& found, std::size_t frame_size, const StreamTimes& times) {
  const std::size_t behind = found.behind.value_or(0);
  const MonoNs latest = std::min(found.first.last - times.character,
                                 found.last.last - Characters(frame_size + behind, times.character));
  MonoNs earliest = found.first.first;
  if (found.behind) {
    // Had the first byte waited for longer, one more frame would have come with it.
    const auto frames = static_cast<MonoNs>(1 + behind / frame_size);
    earliest = std::max(earliest, found.last.last - frames * times.period - Characters(frame_size, times.slowest));
  }
  earliest -= times.latency + times.processing + times.slowest;
  return {earliest, std::max(earliest, latest)};
}

MonoNs EndOf(const Event& event) { return std::max(event.sent.last, event.received.last); }

}  // namespace axlecast::saa_serial
