// Any text: the parser must not crash. It returns an error or all digits of the text as bytes.
#include <cctype>
#include <cstdlib>
#include <string>

#include "core/messages/json/field.h"
#include "tools/axlecast/decode/frame_text.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const std::string text(data, data + size);
  const auto bytes = axlecast::ParseHexLine(text);
  if (!bytes) return 0;
  // The text without prefixes, separators and the comment.
  std::string digits;
  const std::string_view read = std::string_view(text).substr(0, text.find('#'));
  for (const char c : read) {
    if (c == 'x' || c == 'X') {
      digits.pop_back();  // the 0 before it
    } else if (std::isxdigit(static_cast<unsigned char>(c)) != 0) {
      digits += static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
    }
  }
  if (axlecast::HexDigits(*bytes) != digits) std::abort();
  return 0;
}
