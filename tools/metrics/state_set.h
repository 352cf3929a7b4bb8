#pragma once

#include <algorithm>
#include <array>
#include <cstdint>
#include <optional>
#include <string_view>

#include "tools/metrics/exposition.h"

namespace axlecast {

// A state as Prometheus wants it: one sample for each of `names`, 1 for the present one, else 0. The last of `names` is
// for one that nobody tells any more, or that is not known.
template <std::size_t N>
void AddStateSet(Exposition& out, std::string_view label, std::string_view whose,
                 const std::array<std::string_view, N>& names, std::optional<std::int8_t> state) {
  const bool known = state && *state >= 0 && static_cast<std::size_t>(*state) < N - 1;
  const std::size_t present = known ? static_cast<std::size_t>(*state) : N - 1;
  for (std::size_t i = 0; i < N; ++i) out.Add({{label, whose}, {"state", names[i]}}, std::int64_t{i == present});
}

}  // namespace axlecast
