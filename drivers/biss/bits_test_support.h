#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

namespace axlecast::biss {

// "1101 0": zeros fill up the last byte.
inline std::vector<std::uint8_t> BytesOf(const std::string& text) {
  std::vector<std::uint8_t> bytes;
  std::size_t count = 0;
  for (const char digit : text) {
    if (digit != '0' && digit != '1') continue;
    if (count % 8 == 0) bytes.push_back(0);
    if (digit == '1') bytes.back() = static_cast<std::uint8_t>(bytes.back() | 0x80U >> count % 8);
    ++count;
  }
  return bytes;
}

inline std::size_t CountOf(const std::string& text) {
  std::size_t count = 0;
  for (const char digit : text) count += digit == '0' || digit == '1' ? 1U : 0U;
  return count;
}

// The lowest bits of a number, the most significant first.
inline std::string TextOf(std::uint64_t value, int count) {
  std::string text;
  for (int i = count - 1; i >= 0; --i) text += (value >> static_cast<unsigned>(i) & 1U) != 0 ? '1' : '0';
  return text;
}

// A check by the shift register that encoder manuals draw: each bit, with the one that falls out of the last stage,
// is fed back to the stages of the polynomial's terms. A second implementation, one bit at a time.
inline std::string NaiveCrc(const std::string& text, std::uint32_t polynomial, int bits, std::uint32_t start,
                            bool inverted) {
  std::vector<bool> stage(static_cast<std::size_t>(bits));  // stage k holds x^k
  for (std::size_t k = 0; k < stage.size(); ++k) stage[k] = (start >> k & 1U) != 0;
  for (const char digit : text) {
    if (digit != '0' && digit != '1') continue;
    const bool fed = (digit == '1') != stage.back();
    for (std::size_t k = stage.size() - 1; k > 0; --k)
      stage[k] = stage[k - 1] != (fed && (polynomial >> k & 1U) != 0);
    stage[0] = fed;
  }
  std::string check;
  for (std::size_t k = stage.size(); k-- > 0;) check += stage[k] != inverted ? '1' : '0';
  return check;
}

// A whole frame of a position without turns, by the naive check.
inline std::string FrameText(std::uint64_t counts, int bits, const std::string& status = "11") {
  const std::string covered = TextOf(counts, bits) + status;
  return covered + NaiveCrc(covered, 0x43, 6, 0, true);
}

}  // namespace axlecast::biss
