#include "drivers/tsubaki_sc/register_map.h"

#include <string.h>

#include <algorithm>
#include <cassert>

namespace axlecast::tsubaki_sc {
namespace {

constexpr std::size_t kShortest = 8;
constexpr std::size_t kLongest = 16;

// Returns the position of character `index` in the bytes of the registers.
constexpr std::size_t Place(std::size_t index, CharacterOrder order) {
  return order == CharacterOrder::kHighFirst ? index : index ^ 1U;
}

}  // namespace

const char* ExceptionName(std::uint8_t code) {
  constexpr std::array<const char*, 5> kNames = {"unknown error", "function error", "address error", "data error",
                                                 "login error"};
  return kNames.at(code < kNames.size() ? code : 0);
}

std::optional<LogPlace> LogHolding(const Block& data) {
  for (std::size_t log = 0; log < kLogs; ++log) {
    for (std::size_t quantity = 0; quantity < kQuantities; ++quantity) {
      if (LogBlock(log, quantity).Holds(data)) return LogPlace{log, quantity};
    }
  }
  return std::nullopt;
}

std::optional<Block> BlockOf(Bytes request) {
  constexpr std::size_t kReadSize = 8;
  constexpr std::size_t kVersionSize = 4;
  if (request.size() == kVersionSize &&
      request[1] == static_cast<std::uint8_t>(modbus::Function::kReportServerId)) {
    return kVersion;
  }
  if (request.size() != kReadSize) return std::nullopt;
  const auto function = static_cast<modbus::Function>(request[1]);
  if (function < modbus::Function::kReadCoils || function > modbus::Function::kReadInputRegisters) {
    return std::nullopt;
  }
  const auto word = [&](std::size_t at) {
    return static_cast<std::uint16_t>((request[at] << 8) | request[at + 1]);
  };
  return Block{function, word(2), word(4)};
}

std::string RegisterText(Bytes registers, CharacterOrder order) {
  std::string text;
  for (std::size_t i = 0; i + 1 < registers.size(); i += 2) {
    const bool high_first = order == CharacterOrder::kHighFirst;
    for (const std::size_t at : {high_first ? i : i + 1, high_first ? i + 1 : i}) {
      const std::uint8_t c = registers[at];
      text += c == 0 ? ' ' : c >= 0x20 && c < 0x7F ? static_cast<char>(c) : '?';
    }
  }
  text.erase(text.find_last_not_of(' ') + 1);
  return text;
}

std::string VersionText(Bytes version) {
  const unsigned low = version[1];
  return std::to_string(version[0]) + '.' + std::to_string(low >> 4U) + '.' + std::to_string(low & 0x0FU);
}

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
