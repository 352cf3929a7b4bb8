// Any text: the parser must not crash. It returns an error or all digits of the text as bits.
#include <cstdlib>
#include <string>

#include "tools/axlecast/decode/frame_text.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const std::string text(data, data + size);
  const auto parsed = axlecast::ParseBitLine(text);
  if (!parsed) return 0;
  const axlecast::BitLine& line = *parsed;
  if (line.bytes.size() != (line.bits + 7) / 8) std::abort();
  std::string digits;
  const std::string_view read = std::string_view(text).substr(0, text.find('#'));
  for (const char c : read) {
    if (c == '0' || c == '1') digits += c;
    if (c == 'b') digits.pop_back();  // the 0 before it
  }
  std::string bits;
  for (std::size_t i = 0; i < line.bits; ++i) bits += (line.bytes[i / 8] >> (7 - i % 8) & 1) != 0 ? '1' : '0';
  if (bits != digits) std::abort();
  return 0;
}
