#pragma once

#include <cstdint>
#include <string>
#include <vector>

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

}  // namespace axlecast::ssi
