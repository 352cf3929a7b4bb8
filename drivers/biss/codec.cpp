#include "drivers/biss/codec.h"

#include <algorithm>
#include <bit>

#include "drivers/kit/clocked_line.h"

namespace axlecast::biss {

namespace {

constexpr unsigned kRegister = 16;
constexpr std::uint32_t kTop = 1U << (kRegister - 1);

// One bit, in the top of the register, is divided.
constexpr std::uint32_t Divide(std::uint32_t remainder, std::uint32_t polynomial) {
  return ((remainder & kTop) != 0 ? remainder << 1U ^ polynomial : remainder << 1U) & 0xFFFFU;
}

}  // namespace

Crc::Crc(const CrcRule& rule) : bits_(rule.bits), shift_(kRegister - static_cast<unsigned>(rule.bits)) {
  const std::uint32_t polynomial = rule.polynomial << shift_ & 0xFFFFU;  // its highest term is the bit that goes
  for (std::uint32_t byte = 0; byte < table_.size(); ++byte) {
    std::uint32_t remainder = byte << 8U;
    for (int i = 0; i < 8; ++i) remainder = Divide(remainder, polynomial);
    table_[byte] = static_cast<std::uint16_t>(remainder);
  }
  start_ = static_cast<std::uint16_t>(rule.start << shift_);
  inversion_ = rule.inverted ? (1U << static_cast<unsigned>(rule.bits)) - 1 : 0;
}

std::uint32_t Crc::Of(std::uint64_t value, int count) const {
  std::uint32_t remainder = start_;
  int left = count;
  // Bits that fill no byte come first: a table's step over fewer bits than 8 shifts by fewer.
  if (const auto odd = static_cast<unsigned>(left % 8); odd > 0) {
    left -= static_cast<int>(odd);
    const std::uint32_t first =
        (static_cast<std::uint32_t>(value >> static_cast<unsigned>(left)) & ((1U << odd) - 1));
    const std::uint32_t index = remainder >> (kRegister - odd) ^ first;
    remainder = (remainder << odd ^ table_[index & 0xFFU]) & 0xFFFFU;
  }
  while (left > 0) {
    left -= 8;
    const auto byte = static_cast<std::uint32_t>(value >> static_cast<unsigned>(left)) & 0xFFU;
    remainder = (remainder << 8U ^ table_[remainder >> 8U ^ byte]) & 0xFFFFU;
  }
  return remainder >> shift_ ^ inversion_;
}

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
