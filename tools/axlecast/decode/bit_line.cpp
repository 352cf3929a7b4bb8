#include "tools/axlecast/decode/bit_line.h"

#include "tools/axlecast/decode/line_text.h"

namespace axlecast {
namespace {

bool IsSeparator(char c) { return c == '_' || kGroupSeparators.find(c) != std::string_view::npos; }

void Append(BitLine& line, bool bit) {
  const std::size_t place = line.bits++ % 8;
  if (place == 0) line.bytes.push_back(0);
  if (bit) line.bytes.back() |= static_cast<std::uint8_t>(0x80U >> place);
}

}  // namespace

BitLine ParseBitLine(std::string_view text) {
  text = WithoutComment(text);
  BitLine line;
  bool in_group = false;  // the last character was a digit
  for (std::size_t i = 0; i < text.size(); ++i) {
    if (IsSeparator(text[i])) {
      in_group = false;
      continue;
    }
    const bool prefix = !in_group && text.substr(i, 2) == "0b";
    if (prefix) i += 2;
    if (i == text.size() || (text[i] != '0' && text[i] != '1')) {
      const std::string what = i == text.size() ? "the end" : ShownCharacter(text[i]);
      return {{}, 0, AtColumn(i, what + " stands where a 0 or a 1 is expected")};
    }
    in_group = true;
    Append(line, text[i] == '1');
  }
  return line;
}

}  // namespace axlecast
