#include "drivers/tsubaki_sc/parameter_set.h"

#include <algorithm>

namespace axlecast::tsubaki_sc {
namespace {

const Block& BlockOfParameter(const ParameterSpec& parameter) {
  return *std::find_if(kParameterBlocks.begin(), kParameterBlocks.end(),
                       [&](const Block& block) { return parameter.address < block.first + block.count; });
}

}  // namespace

std::vector<Block> BlocksOf(const std::vector<ParameterValue>& parameters) {
  std::vector<Block> blocks;
  for (const Block& block : kParameterBlocks) {
    const bool used = std::any_of(parameters.begin(), parameters.end(), [&](const ParameterValue& value) {
      return BlockOfParameter(*value.parameter) == block;
    });
    if (used) blocks.push_back(block);
  }
  return blocks;
}

std::uint16_t ValueIn(const BlockReader& read, const ParameterSpec& parameter) {
  const Block& block = BlockOfParameter(parameter);
  return read.Register(block, std::size_t{parameter.address} - block.first);
}

}  // namespace axlecast::tsubaki_sc
