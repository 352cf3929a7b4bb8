#pragma once

#include <axlecast/position_block_t.hpp>
#include <cstddef>
#include <cstdint>

#include "core/base/time.h"

namespace axlecast {

// Gathers readings at full rate into POSITION_BLOCK messages: up to 40 consecutive ones of one datum epoch, in
// ascending order of time, spanning at most 100 ms. Doubtful readings are among them, with VALID cleared.
class Block {
 public:
  Block(std::int64_t counts_per_turn, std::int8_t unit, double unit_per_count);

  // The block must be sent before this reading can be added.
  [[nodiscard]] bool MustGoBefore(MonoNs at, std::int32_t epoch) const;
  void Add(Interval at, std::int64_t counts, std::int32_t flags, std::int32_t epoch);
  // A reading failed or was withheld.
  void Miss() { ++message_.missed; }

  [[nodiscard]] bool Full() const { return message_.n == position_block_t::MAX_SAMPLES; }
  // There is something that has waited for 100 ms.
  [[nodiscard]] bool Waited(MonoNs now) const;
  [[nodiscard]] bool empty() const { return message_.n == 0; }

  // The message without utime, boot_id and seq, which the sender fills in.
  [[nodiscard]] position_block_t& Take();
  // After it was sent.
  void Clear();

  static constexpr MonoNs kLongest = 100 * kMillisecond;

 private:
  position_block_t message_;
};

}  // namespace axlecast
