#pragma once

#include <algorithm>
#include <array>
#include <span>

#include "core/device/link.h"

namespace axlecast {

// What an SPI transfer has clocked in, until it is read.
class ClockedIn {
 public:
  // Room for `size` bytes, at most kMaxFrame, that are there to be read from now on; what was not read is dropped.
  [[nodiscard]] std::span<std::uint8_t> Fill(std::size_t size) {
    read_ = 0;
    size_ = size;
    return std::span(bytes_).first(size);
  }
  void Drop() { read_ = size_ = 0; }
  [[nodiscard]] bool empty() const { return read_ == size_; }

  // kOk, or kTimeout when nothing is there.
  [[nodiscard]] ByteLink::ReadResult Read(std::span<std::uint8_t> into) {
    const std::size_t count = std::min(into.size(), size_ - read_);
    if (count == 0) return {ByteLink::Status::kTimeout, 0};
    std::copy_n(bytes_.begin() + static_cast<std::ptrdiff_t>(read_), count, into.begin());
    read_ += count;
    return {ByteLink::Status::kOk, count};
  }

 private:
  std::array<std::uint8_t, kMaxFrame> bytes_{};
  std::size_t read_ = 0;
  std::size_t size_ = 0;
};

}  // namespace axlecast
