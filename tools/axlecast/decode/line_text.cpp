#include "tools/axlecast/decode/line_text.h"

namespace axlecast {

std::string_view WithoutComment(std::string_view text) { return text.substr(0, text.find('#')); }

std::string ShownCharacter(char c) {
  constexpr std::string_view kDigits = "0123456789abcdef";
  if (c >= ' ' && c <= '~') return {'\'', c, '\''};
  const auto byte = static_cast<unsigned char>(c);
  return {'b', 'y', 't', 'e', ' ', '0', 'x', kDigits[byte >> 4U], kDigits[byte & 0x0FU]};
}

std::string AtColumn(std::size_t index, std::string_view what) {
  return "column " + std::to_string(index + 1) + ": " + std::string(what);
}

}  // namespace axlecast
