#pragma once

#include <gtest/gtest.h>

#include <cstdint>
#include <string>
#include <vector>

#include "tests/support/machine_text.h"

namespace axlecast::ssi {

// The levels of a line, in their order; what is neither 0 nor 1 is passed over.
struct ClockedBits {
  explicit ClockedBits(const std::string& text) {
    for (const char c : text) {
      if (c != '0' && c != '1') continue;
      if (count % 8 == 0) bytes.push_back(0);
      if (c == '1') bytes.back() = static_cast<std::uint8_t>(bytes.back() | 0x80U >> count % 8);
      ++count;
    }
  }
  std::vector<std::uint8_t> bytes;
  std::size_t count = 0;
};

// The other way round.
inline std::string LevelText(const std::vector<std::uint8_t>& bytes) {
  std::string text;
  for (const std::uint8_t byte : bytes) {
    for (int bit = 7; bit >= 0; --bit) text += (byte >> bit & 1) != 0 ? '1' : '0';
  }
  return text;
}

// A machine with one bus, `keys` of the bus beside its family, and the keys of its device axis1.
inline std::string MachineText(const std::string& keys, const std::string& device) {
  return "machine: test\nbuses:\n  b: {family: ssi, " + keys + ", devices: {axis1: {" + device + "}}}\n";
}

// The machine as the driver would have it. Fails the test when the text is refused.
inline MachineConfig LoadMachine(const std::string& keys, const std::string& device) {
  return MachineFromText(MachineText(keys, device));
}

// The errors; empty if there are none.
inline std::string ProblemOf(const std::string& keys, const std::string& device) {
  return ErrorsOfText(MachineText(keys, device));
}

}  // namespace axlecast::ssi
