#pragma once

#include <cstdint>
#include <functional>
#include <utility>
#include <vector>

#include "tests/simulation/fault_plan.h"

namespace axlecast::simulation {

// Returns a part of `faults` that is as short as can be found by leaving out ever smaller pieces, and with which `fails` is still true.
[[nodiscard]] inline std::vector<Fault> Shrink(std::vector<Fault> faults,
                                               const std::function<bool(const std::vector<Fault>&)>& fails) {
  for (std::size_t piece = (faults.size() + 1) / 2; piece > 0; piece = piece == 1 ? 0 : (piece + 1) / 2) {
    for (std::size_t begin = 0; begin < faults.size();) {
      std::vector<Fault> fewer(faults.begin(), faults.begin() + static_cast<std::ptrdiff_t>(begin));
      const std::size_t end = std::min(begin + piece, faults.size());
      fewer.insert(fewer.end(), faults.begin() + static_cast<std::ptrdiff_t>(end), faults.end());
      if (fails(fewer)) {
        faults = std::move(fewer);
      } else {
        begin = end;
      }
    }
  }
  return faults;
}

}  // namespace axlecast::simulation
