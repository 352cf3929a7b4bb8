#pragma once

#include <array>
#include <cstddef>
#include <cstdint>

#include "core/base/inline_bytes.h"
#include "core/base/time.h"

namespace axlecast {

// Detects that a stream is silent: nothing has arrived for `tolerance` times its `period`.
class PeriodMonitor {
 public:
  PeriodMonitor(MonoNs period, int tolerance) : limit_(period * tolerance) {}

  // The stream may begin now, or a part of it has arrived.
  void Arrived(MonoNs now) {
    last_ = now;
    reported_ = false;
  }

  // Returns when the stream counts as silent.
  [[nodiscard]] MonoNs due() const { return reported_ ? kNever : last_ + limit_; }

  // Returns true once each time that the stream becomes silent.
  [[nodiscard]] bool FellSilent(MonoNs now) {
    if (reported_ || now < due()) return false;
    reported_ = true;
    return true;
  }
  [[nodiscard]] bool silent() const { return reported_; }

 private:
  MonoNs limit_;
  MonoNs last_ = 0;
  bool reported_ = true;  // nothing is expected before the first Arrived
};

// Received bytes in order, each with the interval in which it arrived, for a parser that searches frames in them. If it is
// full, the oldest bytes are dropped and counted. Allocates nothing.
class ReceiveBuffer {
 public:
  static constexpr std::size_t kCapacity = 1024;

  void Append(Bytes bytes, Interval received);
  // Removes the first `count` bytes, which the parser has used.
  void Drop(std::size_t count);
  void Clear() { Drop(size_); }

  [[nodiscard]] Bytes bytes() const { return {data_.data(), size_}; }
  // Returns when byte `index` of bytes() arrived.
  [[nodiscard]] Interval ArrivalOf(std::size_t index) const;
  // The number of bytes dropped because the buffer was full.
  [[nodiscard]] std::int64_t overflowed() const { return overflowed_; }

 private:
  static constexpr std::size_t kPieces = 64;

  struct Piece {
    std::size_t end = 0;  // index behind its last byte
    Interval received;
  };

  std::array<std::uint8_t, kCapacity> data_{};
  std::size_t size_ = 0;
  std::array<Piece, kPieces> pieces_{};  // what arrived together, in order
  std::size_t piece_count_ = 0;
  std::int64_t overflowed_ = 0;
};

}  // namespace axlecast
