#pragma once

#include <algorithm>
#include <array>
#include <cassert>
#include <cstddef>
#include <cstdint>
#include <initializer_list>
#include <span>

namespace axlecast {

using Bytes = std::span<const std::uint8_t>;

// Up to Capacity bytes in place: requests and replies never allocate.
template <std::size_t Capacity>
class InlineBytes {
 public:
  constexpr InlineBytes() = default;
  constexpr InlineBytes(std::initializer_list<std::uint8_t> bytes) { Append({bytes.begin(), bytes.size()}); }
  explicit constexpr InlineBytes(Bytes bytes) { Append(bytes); }

  constexpr void Append(Bytes bytes) {
    assert(bytes.size() <= Capacity - size_);
    std::copy(bytes.begin(), bytes.end(), data_.begin() + static_cast<std::ptrdiff_t>(size_));
    size_ += bytes.size();
  }
  constexpr void Append(std::uint8_t byte) { Append(Bytes(&byte, 1)); }
  constexpr void Clear() { size_ = 0; }

  [[nodiscard]] constexpr std::size_t size() const { return size_; }
  [[nodiscard]] constexpr bool empty() const { return size_ == 0; }
  [[nodiscard]] constexpr std::size_t room() const { return Capacity - size_; }
  [[nodiscard]] constexpr const std::uint8_t* data() const { return data_.data(); }
  constexpr operator Bytes() const { return {data_.data(), size_}; }  // NOLINT(google-explicit-constructor)

 private:
  std::array<std::uint8_t, Capacity> data_{};
  std::size_t size_ = 0;
};

// A Modbus RTU frame (256 bytes) is the longest frame of any family.
inline constexpr std::size_t kMaxFrame = 264;
using Frame = InlineBytes<kMaxFrame>;

}  // namespace axlecast
