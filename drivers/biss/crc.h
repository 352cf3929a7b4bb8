#pragma once

#include <array>
#include <cstdint>

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

  // As they are on the wire, inverted if the rule says so, of the lowest `count` bits of `value`, at most 64.
  [[nodiscard]] std::uint32_t Of(std::uint64_t value, int count) const;
  [[nodiscard]] int bits() const { return bits_; }

 private:
  // The remainder stands in the upper bits of 16.
  std::array<std::uint16_t, 256> table_{};
  std::uint16_t start_;
  std::uint32_t inversion_;
  int bits_;
  unsigned shift_;
};

}  // namespace axlecast::biss
