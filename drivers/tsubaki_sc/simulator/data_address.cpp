#include "drivers/tsubaki_sc/simulator/data_address.h"

#include <array>
#include <span>

namespace axlecast::tsubaki_sc::simulator {
namespace {

constexpr std::array<Block, 3> kCoils = {{{0, 0, true}, {100, 100, true}, {200, 200, true}}};
constexpr std::array<Block, 1> kInputs = {{{0, 0}}};
constexpr std::array<Block, 4> kInputRegisters = {{{0, 8}, {100, 106}, {200, 204}, {300, 300}}};
constexpr std::array<Block, 5> kHoldingRegisters = {{{0, 54, true},
                                                     {100, 107, true, true},
                                                     {200, 207, true, true},
                                                     {300, 301, false, true},
                                                     {350, 354, false, true}}};

// Log data 1-3: 1000-1019 for the voltage to 1600-1619 for the acceleration on Z, then 2000.. and 3000..
constexpr std::array<Block, 21> LogBlocks() {
  std::array<Block, 21> blocks{};
  for (std::size_t i = 0; i < blocks.size(); ++i) {
    const auto first = static_cast<std::uint16_t>(1000 * (1 + i / 7) + 100 * (i % 7));
    blocks[i] = {first, static_cast<std::uint16_t>(first + 19)};
  }
  return blocks;
}
constexpr std::array<Block, 21> kLogs = LogBlocks();

const Block* Find(std::span<const Block> blocks, std::uint16_t address) {
  for (const Block& block : blocks) {
    if (address >= block.first && address <= block.last) return &block;
  }
  return nullptr;
}

}  // namespace

const Block* BlockAt(Space space, std::uint16_t address) {
  switch (space) {
    case Space::kCoil:
      return Find(kCoils, address);
    case Space::kInputStatus:
      return Find(kInputs, address);
    case Space::kInputRegister: {
      const Block* block = Find(kInputRegisters, address);
      return block != nullptr ? block : Find(kLogs, address);
    }
    case Space::kHoldingRegister:
      return Find(kHoldingRegisters, address);
  }
  return nullptr;
}

Range ParameterRange(std::uint16_t address) {
  switch (address) {
    case kOverheatLimit:
      return {0, 1250};
    case kExcessiveShockLimit:
      return {0, 15'000};
    case kLogInterval:
      return {1, 100};
    default:
      break;
  }
  const int in_set = address % 13;  // each DIP switch setting has 13
  if (in_set < 8) return {0, 10'000};
  return in_set == 8 ? Range{1, 50} : Range{0, 300};
}

}  // namespace axlecast::tsubaki_sc::simulator
