#include "tools/axlecast/hex_line.h"

namespace axlecast {
namespace {

constexpr std::string_view kSeparators = " \t\r,:;-";

// -1 where it is no hex digit.
int Digit(char c) {
  if (c >= '0' && c <= '9') return c - '0';
  if (c >= 'a' && c <= 'f') return c - 'a' + 10;
  if (c >= 'A' && c <= 'F') return c - 'A' + 10;
  return -1;
}

std::string Shown(char c) {
  constexpr std::string_view kDigits = "0123456789abcdef";
  if (c >= ' ' && c <= '~') return {'\'', c, '\''};
  const auto byte = static_cast<unsigned char>(c);
  return {'b', 'y', 't', 'e', ' ', '0', 'x', kDigits[byte >> 4U], kDigits[byte & 0x0FU]};
}

HexLine Wrong(std::size_t index, const std::string& what) {
  return {{}, "column " + std::to_string(index + 1) + ": " + what};
}

}  // namespace

HexLine ParseHexLine(std::string_view text) {
  text = text.substr(0, text.find('#'));
  HexLine line;
  bool in_run = false;  // the last character belongs to a byte
  for (std::size_t i = 0; i < text.size();) {
    if (kSeparators.find(text[i]) != std::string_view::npos) {
      in_run = false;
      ++i;
      continue;
    }
    if (!in_run && text[i] == '0' && i + 1 < text.size() && (text[i + 1] == 'x' || text[i + 1] == 'X')) i += 2;
    in_run = true;
    if (i == text.size() || Digit(text[i]) < 0) {
      return Wrong(i, (i == text.size() ? "the end" : Shown(text[i])) + " stands where a hex digit is expected");
    }
    if (i + 1 == text.size() || Digit(text[i + 1]) < 0) {
      return Wrong(i, Shown(text[i]) + " stands alone: a byte has two hex digits");
    }
    line.bytes.push_back(static_cast<std::uint8_t>(Digit(text[i]) << 4 | Digit(text[i + 1])));
    i += 2;
  }
  return line;
}

}  // namespace axlecast
