// Any text: the parser must not crash, and must either name a problem or give bytes that are all of the text's
// digits.
#include <cctype>
#include <cstdlib>
#include <string>

#include "core/messages/json/field.h"
#include "tools/axlecast/decode/hex_line.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const std::string text(data, data + size);
  const axlecast::HexLine line = axlecast::ParseHexLine(text);
  if (!line.problem.empty()) {
    if (!line.bytes.empty()) std::abort();
    return 0;
  }
  // What is left when prefixes, separators and the comment are taken away.
  std::string digits;
  const std::string_view read = std::string_view(text).substr(0, text.find('#'));
  for (const char c : read) {
    if (c == 'x' || c == 'X') {
      digits.pop_back();  // the 0 before it
    } else if (std::isxdigit(static_cast<unsigned char>(c)) != 0) {
      digits += static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
    }
  }
  if (axlecast::HexDigits(line.bytes) != digits) std::abort();
  return 0;
}
