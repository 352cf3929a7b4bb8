#include "drivers/saa_serial/reading.h"

#include <algorithm>
#include <bit>

namespace axlecast::saa_serial {
namespace {

// Returns where the frame begins in the received bytes; nothing if it is not known yet.
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

// A frame with one or two inverted bits in its header, or without one byte of it, is still this encoder's: it sends no
// other. The request, empty for a pulse, names the address.
template <std::size_t kSize, ReplyHeader kHeader>
ReplyMatch MatchFrame(Bytes request, Bytes reply) {
  constexpr int kInvertedAtMost = 2;
  constexpr int kHeaderBits = 16;
  const std::uint8_t address = ParseRequest(request).value_or(kFixedHeader);
  constexpr int kBits = kSize == ReplySize(kMinBits) ? 16 : kSize == ReplySize(24) ? 24 : kMaxBits;
  const Format format{.bits = kBits, .header = kHeader, .address = address};
  const ReplyError error = ParseReply(reply, format).error;
  if (error == ReplyError::kNone || error == ReplyError::kRange) return ReplyMatch::kYes;
  if (reply.size() != kSize && reply.size() + 1 != kSize) return ReplyMatch::kNo;
  const auto inverted = [&](std::uint8_t wanted) {
    return std::popcount(static_cast<unsigned>(reply[0] ^ kFrameStart)) +
           std::popcount(static_cast<unsigned>(reply[1] ^ wanted));
  };
  const int as_fixed = kHeader != ReplyHeader::kAddress ? inverted(kFixedHeader) : kHeaderBits;
  const int as_address = kHeader != ReplyHeader::kFixed ? inverted(address) : kHeaderBits;
  const int minimum = std::min(as_fixed, as_address);
  if (reply.size() == kSize) {
    if (minimum == 0) return ReplyMatch::kDamaged;
    return minimum <= kInvertedAtMost && error != ReplyError::kHeader ? ReplyMatch::kNearly : ReplyMatch::kNo;
  }
  const bool lost_start = reply[0] == kFixedHeader || reply[0] == address;
  return reply[0] == kFrameStart || lost_start ? ReplyMatch::kNearly : ReplyMatch::kNo;
}

template <std::size_t kSize>
MatchReply MatchRule(ReplyHeader header) {
  switch (header) {
    case ReplyHeader::kAddress:
      return &MatchFrame<kSize, ReplyHeader::kAddress>;
    case ReplyHeader::kFixed:
      return &MatchFrame<kSize, ReplyHeader::kFixed>;
    default:
      return &MatchFrame<kSize, ReplyHeader::kEither>;
  }
}

MatchReply MatchRule(const Format& format) {
  switch (DataBytes(format.bits)) {
    case 2:
      return MatchRule<ReplySize(kMinBits)>(format.header);
    case 3:
      return MatchRule<ReplySize(24)>(format.header);
    default:
      return MatchRule<ReplySize(kMaxBits)>(format.header);
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
      return &LengthOfReply<ReplySize(kMinBits)>;
    case 3:
      return &LengthOfReply<ReplySize(24)>;
    default:
      return &LengthOfReply<ReplySize(kMaxBits)>;
  }
}

std::size_t BeginOfReply(Bytes so_far) { return FrameBegin(so_far).value_or(so_far.size()); }

ReplyShape ShapeOf(const Format& format) {
  constexpr std::uint32_t kAnyAddress = 0;
  const std::uint32_t reply = format.header == ReplyHeader::kAddress ? format.address : kAnyAddress;
  return {.reply = reply, .refusal = reply, .match = MatchRule(format)};
}

PolledReading ReadReply(const Event& event, const Format& format, MonoNs character) {
  PolledReading polled;
  Reading& reading = polled.reading;
  reading.at = {event.sent.first, EndOf(event)};
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

void StalledFrames::Restart(MonoNs now) {
  arrived_ = now;
  until_ = 0;
  behind_.reset();
  earliest_.reset();
}

void StalledFrames::Arrived(MonoNs now) {
  const MonoNs pause = now - arrived_;
  if (pause > times_.period + times_.latency) until_ = now + times_.late;
  if (pause > times_.period + times_.period / 8) behind_.reset();
  arrived_ = now;
}

Interval StalledFrames::Widened(Interval at) {
  if (earliest_ && arrived_ < until_) at.first = Earliest(at.first);
  earliest_ = at.first;
  return at;
}

MonoNs StalledFrames::Earliest(MonoNs in_time) {
  // The encoder's clock may be this much faster than its nominal refresh rate.
  const MonoNs shortest_period = times_.period / 100 * 99;
  const MonoNs longest_stall = in_time - std::max<MonoNs>(0, times_.late - times_.latency);
  MonoNs earliest = std::max(*earliest_ + shortest_period, longest_stall);
  if (behind_) earliest = std::max(earliest, in_time - *behind_);
  if (earliest >= in_time) {  // nothing can be late any more
    until_ = 0;
    return in_time;
  }
  if (behind_ || in_time - earliest <= times_.period) behind_ = in_time - earliest;
  return earliest;
}

MonoNs EndOf(const Event& event) { return std::max(event.sent.last, event.received.last); }

}  // namespace axlecast::saa_serial
