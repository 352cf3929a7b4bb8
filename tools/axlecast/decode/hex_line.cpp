#include "tools/axlecast/decode/hex_line.h"

#include "tools/axlecast/decode/line_text.h"

namespace axlecast {
namespace {

// -1 where it is no hex digit.
int Digit(char c) {
  if (c >= '0' && c <= '9') return c - '0';
  if (c >= 'a' && c <= 'f') return c - 'a' + 10;
  if (c >= 'A' && c <= 'F') return c - 'A' + 10;
  return -1;
}

HexLine Wrong(std::size_t index, const std::string& what) { return {{}, AtColumn(index, what)}; }

}  // namespace

HexLine ParseHexLine(std::string_view text) {
  text = WithoutComment(text);
  HexLine line;
  bool in_run = false;  // the last character belongs to a byte
  for (std::size_t i = 0; i < text.size();) {
    if (kGroupSeparators.find(text[i]) != std::string_view::npos) {
      in_run = false;
      ++i;
      continue;
    }
    if (!in_run && text[i] == '0' && i + 1 < text.size() && (text[i + 1] == 'x' || text[i + 1] == 'X')) i += 2;
    in_run = true;
    if (i == text.size() || Digit(text[i]) < 0) {
      return Wrong(
          i, (i == text.size() ? "the end" : ShownCharacter(text[i])) + " stands where a hex digit is expected");
    }
    if (i + 1 == text.size() || Digit(text[i + 1]) < 0) {
      return Wrong(i, ShownCharacter(text[i]) + " stands alone: a byte has two hex digits");
    }
    line.bytes.push_back(static_cast<std::uint8_t>(Digit(text[i]) << 4 | Digit(text[i + 1])));
    i += 2;
  }
  return line;
}

}  // namespace axlecast
