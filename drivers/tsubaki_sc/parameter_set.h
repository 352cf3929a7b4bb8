#pragma once

#include <cstdint>
#include <vector>

#include "core/device/parameter.h"
#include "drivers/tsubaki_sc/block_reader.h"

namespace axlecast::tsubaki_sc {

// A parameter and the value that it shall have, or has.
struct ParameterValue {
  const ParameterSpec* parameter = nullptr;
  std::uint16_t value = 0;
};

// The blocks of kParameterBlocks that hold these parameters, in order.
[[nodiscard]] std::vector<Block> BlocksOf(const std::vector<ParameterValue>& parameters);
// A parameter's register, from a reader of such blocks.
[[nodiscard]] std::uint16_t ValueIn(const BlockReader& read, const ParameterSpec& parameter);

}  // namespace axlecast::tsubaki_sc
