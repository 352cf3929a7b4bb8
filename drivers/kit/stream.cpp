#include "drivers/kit/stream.h"

#include <algorithm>
#include <cassert>

namespace axlecast {

void ReceiveBuffer::Append(Bytes bytes, Interval received) {
  if (bytes.size() > kCapacity) {
    overflowed_ += static_cast<std::int64_t>(bytes.size() - kCapacity);
    bytes = bytes.last(kCapacity);
  }
  if (bytes.empty()) return;
  if (bytes.size() > kCapacity - size_) {
    const std::size_t lost = bytes.size() - (kCapacity - size_);
    overflowed_ += static_cast<std::int64_t>(lost);
    Drop(lost);
  }
  std::copy(bytes.begin(), bytes.end(), data_.begin() + static_cast<std::ptrdiff_t>(size_));
  size_ += bytes.size();
  if (piece_count_ < kPieces) {
    pieces_[piece_count_++] = {.end = size_, .received = received};
  } else {
    // Many small pieces: the newest shares an interval with the one before it, which stays true for both.
    pieces_.back().end = size_;
    pieces_.back().received.last = received.last;
  }
}

void ReceiveBuffer::Drop(std::size_t count) {
  assert(count <= size_);
  std::copy(data_.begin() + static_cast<std::ptrdiff_t>(count), data_.begin() + static_cast<std::ptrdiff_t>(size_),
            data_.begin());
  size_ -= count;
  const auto end = pieces_.begin() + static_cast<std::ptrdiff_t>(piece_count_);
  const auto kept = std::find_if(pieces_.begin(), end, [count](const Piece& piece) { return piece.end > count; });
  std::copy(kept, end, pieces_.begin());
  piece_count_ = static_cast<std::size_t>(end - kept);
  for (std::size_t i = 0; i < piece_count_; ++i) pieces_[i].end -= count;
}

Interval ReceiveBuffer::ArrivalOf(std::size_t index) const {
  assert(index < size_);
  std::size_t i = 0;
  while (pieces_[i].end <= index) ++i;
  return pieces_[i].received;
}

}  // namespace axlecast
