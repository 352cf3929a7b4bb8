#pragma once

#include <cstdint>
#include <deque>
#include <functional>
#include <string>
#include <vector>

#include "core/base/time.h"

namespace axlecast::ssi {

// Levels of a data word, the first to be sent in front.
using Levels = std::vector<bool>;

// How a simulated encoder lays out what it sends. Places count from 0, the first that is sent.
struct SimulatedWord {
  struct Flag {
    std::string name;
    int place = 0;
    bool active_level = true;
  };

  int length = 12;
  int position_at = 0;  // of the multi-turn bits, and the single-turn bits behind them
  int turn_bits = 0;
  int bits = 12;
  bool gray = false;
  bool one_gray_code = true;  // over both parts; false: one each
  std::vector<Flag> flags = {};
  int parity_at = -1;  // -1: none
  bool parity_odd = false;

  // The word of a shaft at `counts` in turn `turns`, with these flags raised (by their order, as bits).
  [[nodiscard]] Levels Make(std::uint32_t turns, std::uint32_t counts, std::uint32_t raised) const;
};

// The serial side of an encoder: monoflop, shift register and data line, edge by edge (TWK SSI 4; SAA manual 5.5).
// Instants are those at which the host sees or makes an edge, and do not run backwards.
class SimulatedOutput {
 public:
  enum class AfterWord : std::uint8_t { kZeros, kOneZero, kNoGap };

  void SetMonoflop(MonoNs time) { monoflop_ = time; }
  void SetAfterWord(AfterWord after) { after_ = after; }

  // "The first negative edge sets the monoflop and stores the data", fetched from `latch`; each further one retriggers
  // it.
  void Fall(MonoNs at, const std::function<Levels(MonoNs at)>& latch);
  // "Each further positive edge causes the next highest bit to be transferred."
  void Rise(MonoNs at);
  // The encoder lost its supply for a moment.
  void Reset(MonoNs at);
  // The level of the data line just before `at`.
  [[nodiscard]] bool LevelBefore(MonoNs at);

  // The monoflop still runs.
  [[nodiscard]] bool IsSet(MonoNs at) const { return set_ && at < expires_; }
  [[nodiscard]] const Levels& word() const { return word_; }

 private:
  struct Change {
    MonoNs at = 0;
    bool level = true;
  };

  void RunDown(MonoNs now);
  [[nodiscard]] bool LevelOf(std::size_t clocks) const;

  MonoNs monoflop_ = 0;
  AfterWord after_ = AfterWord::kZeros;
  bool set_ = false;
  MonoNs expires_ = 0;
  Levels word_;
  std::size_t clocks_ = 0;  // positive edges since the word was stored
  bool level_ = true;       // before the first of changes_
  std::deque<Change> changes_;
};

}  // namespace axlecast::ssi
