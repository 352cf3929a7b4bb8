#pragma once

#include <array>
#include <cstddef>
#include <cstdint>

#include "core/base/inline_bytes.h"
#include "core/base/time.h"

namespace axlecast {

// Watches a stream that should come once per `period`, and says when it has fallen silent: when nothing has come
// for `tolerance` periods.
class PeriodMonitor {
 public:
  PeriodMonitor(MonoNs period, int tolerance) : limit_(period * tolerance) {}

  // The stream may begin now; or one of it came.
  void Arrived(MonoNs now) {
    last_ = now;
    reported_ = false;
  }

  // When to ask again.
  [[nodiscard]] MonoNs due() const { return reported_ ? kNever : last_ + limit_; }

  // True once for every time that the stream falls silent.
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

// Bytes that came unasked, in order, each with the instants between which it arrived, for a parser that looks for
// frames in them. Bounded: when it is full the oldest bytes go and are counted. Allocates nothing.
class ReceiveBuffer {
 public:
  static constexpr std::size_t kCapacity = 1024;

  void Append(Bytes bytes, Interval received);
  // The parser is done with the first `count` bytes.
  void Drop(std::size_t count);
  void Clear() { Drop(size_); }

  [[nodiscard]] Bytes bytes() const { return {data_.data(), size_}; }
  // When byte `index` of bytes() came.
  [[nodiscard]] Interval ArrivalOf(std::size_t index) const;
  // Bytes that nobody parsed in time.
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
