#pragma once

#include <array>
#include <cstdint>
#include <optional>

#include "core/base/time.h"

namespace axlecast::tformat {

// The encoder's EEPROM: the user's cells 0..79 (all 0 at shipping) and the store of the single-turn zero, which
// share one wear. A write takes 18 ms, during which nothing else gets at the memory (TS5669 spec 6.1.1, 8.1, Table
// 4).
class EncoderEeprom {
 public:
  static constexpr std::uint8_t kCells = 80;
  static constexpr MonoNs kWriteTime = 18 * kMillisecond;
  static constexpr std::int64_t kRewrites = 100'000;  // "Total 100,000 times"

  // Completes what is due.
  void Advance(MonoNs now);
  [[nodiscard]] bool Busy(MonoNs now) const { return now < busy_until_; }

  // Only when not busy. A worn-out memory takes the time and keeps its old content.
  void Write(std::uint8_t cell, std::uint8_t data, MonoNs now);
  [[nodiscard]] std::uint8_t Read(std::uint8_t cell) const { return cells_.at(cell); }
  // Stores the zero: takes the time and the wear of a write. False when the memory is worn out.
  bool StoreZero(MonoNs now);
  // The supply fails: a write under way is lost.
  void PowerOff(MonoNs now);

  // From outside, without time or wear: what a cell held when the encoder was delivered, how worn it is.
  void Preset(std::uint8_t cell, std::uint8_t data) { cells_.at(cell) = data; }
  void SetWear(std::int64_t writes) { wear_ = writes; }

  [[nodiscard]] std::int64_t wear() const { return wear_; }
  [[nodiscard]] std::int64_t writes_done() const { return writes_done_; }
  [[nodiscard]] std::int64_t writes_lost() const { return writes_lost_; }

 private:
  struct CellWrite {
    std::uint8_t cell;
    std::uint8_t data;
  };
  [[nodiscard]] bool Wear(MonoNs now);

  std::array<std::uint8_t, kCells> cells_{};
  std::optional<CellWrite> under_way_;
  MonoNs busy_until_ = INT64_MIN;
  std::int64_t wear_ = 0;
  std::int64_t writes_done_ = 0;
  std::int64_t writes_lost_ = 0;
};

}  // namespace axlecast::tformat
