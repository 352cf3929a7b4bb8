// Whatever the bytes: what is shown is UTF-8 without control characters, and showing it again changes nothing.

#include "core/base/text.h"

#include <cstddef>
#include <cstdint>
#include <string>

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using axlecast::TextShape;
  const std::string text(reinterpret_cast<const char*>(data), size);
  for (const TextShape shape : {TextShape::kLines, TextShape::kOneLine}) {
    const std::string shown = axlecast::TerminalText(text, shape);
    if (shown.size() > 3 * text.size() || axlecast::TerminalText(shown, shape) != shown) __builtin_trap();
    for (const char c : shown) {
      const bool allowed = shape == TextShape::kLines && (c == '\t' || c == '\n');
      if (!allowed && ((c >= 0 && c < ' ') || c == 0x7F)) __builtin_trap();
    }
    if (axlecast::Shortened(shown, size / 2).size() > size / 2) __builtin_trap();
  }
  return 0;
}
