#include "drivers/biss/codec.h"

#include <algorithm>
#include <bit>

#include "drivers/kit/clocked_line.h"

namespace axlecast::biss {
namespace {

// Samples before the second rising edge of the clock (5.6): the line idles high.
constexpr std::size_t kIdleSamples = 2;

// The first sample from `from` on that is `level`, or `end`.
std::size_t Find(bool level, Bytes samples, std::size_t from, std::size_t end) {
  const std::uint8_t flip = level ? 0x00 : 0xFF;
  while (from < end) {
    const auto rest = static_cast<std::uint8_t>((samples[from / 8] ^ flip) << from % 8);
    if (rest != 0) return std::min(end, from + static_cast<std::size_t>(std::countl_zero(rest)));
    from += 8 - from % 8;
  }
  return end;
}

std::uint32_t Lowest(std::uint64_t value, int count) {
  return static_cast<std::uint32_t>(value & ((std::uint64_t{1} << static_cast<unsigned>(count)) - 1));
}

// `limit` is the last place where it may be; kAnywhere has no place behind it.
std::size_t EndOf(std::size_t limit, std::size_t size) { return limit < size ? limit + 1 : size; }

Reply Failed(Reply reply, FrameError error) {
  reply.error = error;
  return reply;
}

}  // namespace

FrameReader::FrameReader(const Format& format) : format_(format), crc_(format.crc) {}

Reply FrameReader::ReadTransfer(Bytes samples, std::size_t end, const Search& search) const {
  Reply reply;
  if (end < kIdleSamples) return Failed(reply, FrameError::kShort);
  const std::size_t ack_end = EndOf(search.latest_ack, end);
  reply.ack = Find(false, samples, 0, ack_end);
  if (reply.ack < kIdleSamples) return Failed(reply, FrameError::kLow);
  if (reply.ack >= ack_end) return Failed(reply, FrameError::kNoAck);
  const std::size_t start_end = EndOf(search.latest_start, end);
  reply.start = Find(true, samples, reply.ack, start_end);
  if (reply.start >= start_end) return Failed(reply, FrameError::kNoStart);
  if (reply.start + 1 >= end) return Failed(reply, FrameError::kShort);
  if (BitAt(samples, reply.start + 1)) return Failed(reply, FrameError::kCds);
  Reply frame = ReadFrame(samples, reply.start + 2, end);
  frame.ack = reply.ack;
  frame.start = reply.start;
  return frame;
}

Reply FrameReader::ReadFrame(Bytes bits, std::size_t first, std::size_t end) const {
  Reply reply;
  if (first + frame_bits() > end) return Failed(reply, FrameError::kShort);
  const int data_bits = format_.turn_bits + format_.bits + 2;
  const std::uint64_t data = BitsAt(bits, first, static_cast<std::size_t>(data_bits));
  const std::uint64_t check =
      BitsAt(bits, first + static_cast<std::size_t>(data_bits), static_cast<std::size_t>(crc_.bits()));
  if (crc_.Of(data, data_bits) != check) return Failed(reply, FrameError::kChecksum);
  reply.warned = (data & 1) == 0;
  reply.failed = (data >> 1U & 1) == 0;
  reply.counts = Lowest(data >> 2U, format_.bits);
  reply.turns = Lowest(data >> static_cast<unsigned>(2 + format_.bits), format_.turn_bits);
  return reply;
}

}  // namespace axlecast::biss
