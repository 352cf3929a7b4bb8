#include "drivers/saa_serial/codec.h"

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

}  // namespace axlecast::saa_serial
