#pragma once

#include <array>
#include <cstddef>
#include <cstdint>

#include "core/base/inline_bytes.h"

// BiSS-C, point to point, as the SAA series' operation manual gives it (5.6). Pure functions of bits.

namespace axlecast::biss {

inline constexpr int kMinCrcBits = 3;
inline constexpr int kMaxCrcBits = 16;

// How a frame is protected. SAA manual 5.6: x^6 + x + 1, start 0 (its example shows it), "negative logic". The input
// is taken most significant bit first: "CRC-6/G-704" has the same polynomial, but is reflected and not this one.
struct CrcRule {
  int bits = 6;
  std::uint32_t polynomial = 0x43;  // with its highest term: x^6 + x + 1 = 100 0011
  std::uint32_t start = 0;
  bool inverted = true;
};

// The check bits of a value, by a table that the constructor makes.
class Crc {
 public:
  explicit Crc(const CrcRule& rule);

  // As they are on the wire, inverted if the rule requires it, of the lowest `count` bits of `value`, at most 64.
  [[nodiscard]] std::uint32_t Of(std::uint64_t value, int count) const;
  [[nodiscard]] int bits() const { return bits_; }

 private:
  // The remainder is in the upper bits of 16.
  std::array<std::uint16_t, 256> table_{};
  std::uint16_t start_;
  std::uint32_t inversion_;
  int bits_;
  unsigned shift_;
};

inline constexpr int kMinBits = 10;  // of the position
inline constexpr int kMaxBits = 32;
inline constexpr int kMaxTurnBits = 24;
// Turns and position together: counts are exact up to 2^52.
inline constexpr int kMaxPositionBits = 52;

// What a frame holds from its first bit after the fixed 0 on: turns, position, nError, nWarning, check bits.
struct Format {
  int bits = 16;
  int turn_bits = 0;  // sent before the position, most significant first; 0: single-turn
  CrcRule crc = {};
};
[[nodiscard]] constexpr int FrameBits(const Format& format) {
  return format.turn_bits + format.bits + 2 + format.crc.bits;
}

// How late the answer may come: the last sample of a transfer that may be the first of the acknowledgement, or the
// start bit. kAnywhere: whatever fits.
inline constexpr std::size_t kAnywhere = SIZE_MAX;
struct Search {
  std::size_t latest_ack = kAnywhere;
  std::size_t latest_start = kAnywhere;
};

enum class FrameError : std::uint8_t {
  kNone,
  kLow,       // the line is not high before the second rising edge, which alone can pull it low
  kNoAck,     // it stays high: nobody is there, or the clock does not reach the encoder
  kNoStart,   // acknowledged, but no start bit: the encoder is still busy
  kShort,     // the samples end before the frame does
  kCds,       // the fixed 0 after the start bit is 1
  kChecksum,  // the check bits are others
};

struct Reply {
  FrameError error = FrameError::kNone;
  // Where they were found, in samples from the transfer's first.
  std::size_t ack = 0;
  std::size_t start = 0;
  // Without an error:
  std::uint32_t counts = 0;  // [0, 2^bits)
  std::uint32_t turns = 0;   // [0, 2^turn_bits)
  bool failed = false;       // nError is 0: the position is not valid
  bool warned = false;       // nWarning is 0
};

// Reads frames of one format.
class FrameReader {
 public:
  explicit FrameReader(const Format& format);

  // A transfer as it was clocked in, one sample a clock, the first bit the most significant of the first byte; `end`
  // is one past the last sample.
  [[nodiscard]] Reply ReadTransfer(Bytes samples, std::size_t end, const Search& search) const;
  // A frame without what is before it; `first` is the bit at which it begins, `end` one past the last that there is.
  [[nodiscard]] Reply ReadFrame(Bytes bits, std::size_t first, std::size_t end) const;

  [[nodiscard]] std::size_t frame_bits() const { return static_cast<std::size_t>(FrameBits(format_)); }

 private:
  Format format_;
  Crc crc_;
};

}  // namespace axlecast::biss
