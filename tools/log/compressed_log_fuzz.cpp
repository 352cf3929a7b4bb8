// Any bytes as a compressed log: what is read and what is damaged stay within the file, in order; a frame behind them is found; and
// what is compressed is read back.
#include <algorithm>
#include <cstdlib>
#include <vector>

#include "tools/log/compressed_log.h"

namespace {

using axlecast::Bytes;

void Require(bool holds) {
  if (!holds) std::abort();
}

constexpr std::size_t kMaxContent = 64U << 20;  // of a bomb

std::vector<std::uint8_t> Read(Bytes file) {
  std::vector<std::uint8_t> content;
  std::size_t before = 0;
  const auto damage = axlecast::Decompress(file, [&](Bytes piece, std::size_t position) {
    Require(position <= file.size());
    before = position;
    content.insert(content.end(), piece.begin(), piece.end());
    return content.size() < kMaxContent;
  });
  std::size_t end = 0;
  for (const axlecast::CompressedDamage& region : damage) {
    Require(region.size > 0 && region.offset >= end && region.offset + region.size <= file.size());
    end = region.offset + region.size;
  }
  return content;
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const Bytes bytes(data, size);
  static_cast<void>(Read(bytes));
  static_cast<void>(axlecast::FindSummary(bytes));
  if (size == 0) return 0;
  axlecast::LogCompressor compressor;
  const auto frame = compressor.Compress(bytes);
  Require(frame.has_value() && axlecast::IsCompressed(*frame) && std::ranges::equal(Read(*frame), bytes));
  return 0;
}
