#include "drivers/tsubaki_sc/password.h"

#include <algorithm>
#include <array>
#include <cassert>
#include <cstring>

namespace axlecast::tsubaki_sc {
namespace {

constexpr std::size_t kShortest = 8;
constexpr std::size_t kLongest = 16;

// Where character `index` stands in the bytes of the registers.
constexpr std::size_t Place(std::size_t index, CharacterOrder order) {
  return order == CharacterOrder::kHighFirst ? index : index ^ 1U;
}

}  // namespace

bool IsPassword(std::string_view text) {
  return text.size() >= kShortest && text.size() <= kLongest &&
         std::all_of(text.begin(), text.end(), [](char c) { return c >= 0x21 && c <= 0x7E; });
}

Frame WritePassword(std::uint8_t address, const Block& block, std::string_view text, const PasswordFormat& format) {
  assert(IsPassword(text));
  std::array<std::uint16_t, kLongest / 2> values{};
  for (std::size_t index = 0; index < kLongest; ++index) {
    const std::uint8_t c = index < text.size() ? static_cast<std::uint8_t>(text[index]) : format.padding;
    const std::size_t place = Place(index, format.order);
    values[place / 2] = static_cast<std::uint16_t>(values[place / 2] | (c << (place % 2 == 0 ? 8 : 0)));
  }
  const Frame frame = modbus::WriteRegisters(address, block.first, values);
  explicit_bzero(values.data(), sizeof values);
  return frame;
}

bool HoldsPassword(Bytes registers, std::string_view text, CharacterOrder order) {
  if (registers.size() != kLongest) return false;
  bool equal = true;
  for (std::size_t index = 0; index < kLongest; ++index) {
    const std::uint8_t c = registers[Place(index, order)];
    const bool same = index < text.size() ? c == static_cast<std::uint8_t>(text[index]) : c == 0x00 || c == 0x20;
    equal = equal && same;
  }
  return equal;
}

void Wipe(Frame& frame) {
  explicit_bzero(&frame, sizeof frame);
  frame.Clear();
}

}  // namespace axlecast::tsubaki_sc
