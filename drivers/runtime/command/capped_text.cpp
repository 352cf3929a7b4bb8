#include "drivers/runtime/command/capped_text.h"

#include <cstdint>

namespace axlecast {
namespace {

bool IsContinuation(char c) { return (static_cast<std::uint8_t>(c) & 0xC0) == 0x80; }

// Bytes of the well-formed character at the beginning of `text` (RFC 3629, section 4); 0 when there is none.
std::size_t CharacterLength(std::string_view text) {
  const auto first = static_cast<std::uint8_t>(text[0]);
  if (first < 0x80) return 1;
  const std::size_t length = first >= 0xC2 && first <= 0xDF   ? 2
                             : first >= 0xE0 && first <= 0xEF ? 3
                             : first >= 0xF0 && first <= 0xF4 ? 4
                                                              : 0;
  if (length == 0 || text.size() < length) return 0;
  for (std::size_t i = 1; i < length; ++i) {
    if (!IsContinuation(text[i])) return 0;
  }
  const auto second = static_cast<std::uint8_t>(text[1]);
  const bool overlong = (first == 0xE0 && second < 0xA0) || (first == 0xF0 && second < 0x90);
  const bool surrogate = first == 0xED && second > 0x9F;
  const bool beyond = first == 0xF4 && second > 0x8F;
  return overlong || surrogate || beyond ? 0 : length;
}

}  // namespace

std::string CappedText(std::string_view text, std::size_t bytes) {
  std::string capped;
  while (!text.empty()) {
    const std::size_t length = CharacterLength(text);
    const auto first = static_cast<std::uint8_t>(text[0]);
    const bool shown = length > 1 || (length == 1 && first >= 0x20 && first != 0x7F);
    const std::string_view character = shown ? text.substr(0, length) : std::string_view("?");
    if (capped.size() + character.size() > bytes) break;
    capped += character;
    text.remove_prefix(length == 0 ? 1 : length);
  }
  return capped;
}

std::string WordsWithin(std::span<const std::string> words, std::size_t bytes) {
  std::string text;
  for (std::size_t i = 0; i < words.size(); ++i) {
    const bool last = i + 1 == words.size();
    const std::size_t with_word = text.size() + words[i].size() + 1;  // and a blank
    const std::size_t most = last ? bytes + 1 : bytes - kAndMore.size();
    if (with_word > most) return text + std::string(kAndMore);
    text += words[i];
    if (!last) text += ' ';
  }
  return text;
}

}  // namespace axlecast
