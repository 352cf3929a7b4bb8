#include "core/base/truncated_text.h"

#include <algorithm>
#include <cstdint>

#include "core/base/utf8.h"

namespace axlecast {
std::string CutText(std::string_view text, std::size_t room) {
  while (room > 0 && IsContinuation(text[room])) --room;
  const std::size_t blank = text.rfind(' ', room);
  const bool long_word = blank == std::string_view::npos || blank < room / 2;
  return std::string(text.substr(0, long_word ? room : blank)) + std::string(kCutMark);
}

std::string CappedText(std::string_view text, std::size_t bytes) {
  std::string capped;
  while (!text.empty()) {
    const std::size_t length = FirstCharacter(text).size;
    const auto first = static_cast<std::uint8_t>(text[0]);
    const bool shown = length > 1 || (length == 1 && first >= 0x20 && first != 0x7F);
    const std::string_view character = shown ? text.substr(0, length) : std::string_view("?");
    if (capped.size() + character.size() > bytes) {
      const bool sentence = capped.find(' ') != std::string::npos && bytes > kCutMark.size();
      return sentence ? CutText(capped, std::min(bytes - kCutMark.size(), capped.size() - 1)) : capped;
    }
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
    const std::size_t maximum = last ? bytes + 1 : bytes - kAndMore.size();
    if (with_word > maximum) return text + std::string(kAndMore);
    text += words[i];
    if (!last) text += ' ';
  }
  return text;
}

}  // namespace axlecast
