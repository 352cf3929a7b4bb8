// Whatever the bytes: what is shown is UTF-8 without control characters, and showing it again changes nothing.

#include <cstddef>
#include <cstdint>
#include <string>

#include "drivers/runtime/core/visible_text.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const std::string text(reinterpret_cast<const char*>(data), size);
  const std::string shown = axlecast::VisibleText(text);
  if (shown.size() > text.size() || axlecast::VisibleText(shown) != shown) __builtin_trap();
  for (const char c : shown) {
    if ((c >= 0 && c < ' ') || c == 0x7F) __builtin_trap();
  }
  if (axlecast::Shortened(shown, size / 2).size() > size / 2) __builtin_trap();
  return 0;
}
