#include "drivers/saa_serial/codec.h"

#include <algorithm>
#include <array>
#include <bit>

namespace axlecast::saa_serial {
namespace {

bool HeaderAllowed(std::uint8_t header, const Format& format) {
  const bool own = header == format.address && format.header != ReplyHeader::kFixed;
  return own || (header == kFixedHeader && format.header != ReplyHeader::kAddress);
}

}  // namespace

std::uint8_t Checksum(Bytes bytes) {
  unsigned sum = 0;
  for (const std::uint8_t byte : bytes) sum += byte;
  return static_cast<std::uint8_t>(sum);
}

Reply ParseReply(Bytes bytes, const Format& format) {
  Reply reply;
  const std::size_t size = ReplySize(format.bits);
  if (bytes.size() != size) {
    reply.error = bytes.size() < size ? ReplyError::kShort : ReplyError::kLong;
    return reply;
  }
  reply.header = bytes[1];
  for (const std::uint8_t byte : bytes.subspan(2, DataBytes(format.bits))) reply.counts = reply.counts << 8U | byte;
  if (bytes[0] != kFrameStart) {
    reply.error = ReplyError::kStart;
  } else if (Checksum(bytes.first(size - 1)) != bytes[size - 1]) {
    reply.error = ReplyError::kChecksum;
  } else if (!HeaderAllowed(reply.header, format)) {
    reply.error = ReplyError::kHeader;
  } else if (reply.counts >> static_cast<unsigned>(format.bits) != 0) {
    reply.error = ReplyError::kRange;
  }
  return reply;
}

Frame Request(std::uint8_t command) { return {kRequestStart, kRequestMark, command}; }

std::optional<std::uint8_t> ParseRequest(Bytes bytes) {
  if (bytes.size() != kRequestSize || bytes[0] != kRequestStart || bytes[1] != kRequestMark) return std::nullopt;
  return bytes[2];
}

// ---- one exchange ----

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
  using K = ErrorKind;
  constexpr std::array kKinds = {K::kChecksum, K::kShort,     K::kChecksum, K::kChecksum,
                                 K::kChecksum, K::kWrongEcho, K::kRange};
  return kKinds.at(static_cast<std::size_t>(error));
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

// In the order of ReplyHeader.
template <std::size_t kSize>
constexpr std::array<MatchReply, 3> kMatchRules = {&MatchFrame<kSize, ReplyHeader::kEither>,
                                                   &MatchFrame<kSize, ReplyHeader::kAddress>,
                                                   &MatchFrame<kSize, ReplyHeader::kFixed>};

// Returns which of the three sizes of frames an encoder of `bits` sends.
std::size_t SizeIndex(int bits) { return DataBytes(bits) - DataBytes(kMinBits); }

MatchReply MatchRule(const Format& format) {
  constexpr std::array kRules = {kMatchRules<ReplySize(kMinBits)>, kMatchRules<ReplySize(24)>,
                                 kMatchRules<ReplySize(kMaxBits)>};
  return kRules.at(SizeIndex(format.bits)).at(static_cast<std::size_t>(format.header));
}

}  // namespace

ReplyLength LengthRule(int bits) {
  constexpr std::array<ReplyLength, 3> kRules = {&LengthOfReply<ReplySize(kMinBits)>, &LengthOfReply<ReplySize(24)>,
                                                 &LengthOfReply<ReplySize(kMaxBits)>};
  return kRules.at(SizeIndex(bits));
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
  reading.at = {event.sent.first, event.End()};
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
  reading.at = event.ActedWithin(size, character);
  return polled;
}

}  // namespace axlecast::saa_serial
