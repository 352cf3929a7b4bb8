#include "drivers/runtime/core/visible_text.h"

#include <cstddef>

#include "drivers/runtime/core/utf8.h"

namespace axlecast {
namespace {

bool IsShown(char32_t code) {
  const auto within = [code](char32_t first, char32_t last) { return code >= first && code <= last; };
  const bool control = code < 0x20 || within(0x7F, 0x9F);
  const bool direction =
      code == 0x61C || within(0x200E, 0x200F) || within(0x202A, 0x202E) || within(0x2066, 0x2069);
  const bool hidden = code == 0xAD || within(0x200B, 0x200D) || within(0x2028, 0x2029) || within(0x2060, 0x2065) ||
                      within(0x206A, 0x206F) || code == 0xFEFF || within(0xFFF9, 0xFFFB) ||
                      within(0xE0000, 0xE0FFF);
  return !control && !direction && !hidden;
}

}  // namespace

std::string VisibleText(std::string_view text) {
  std::string shown;
  shown.reserve(text.size());
  while (!text.empty()) {
    const Utf8Character character = FirstCharacter(text);
    const std::size_t size = character.size == 0 ? 1 : character.size;
    if (character.size != 0 && IsShown(character.code)) {
      shown += text.substr(0, size);
    } else {
      shown += '?';
    }
    text.remove_prefix(size);
  }
  return shown;
}

std::string_view Shortened(std::string_view text, std::size_t size) {
  if (text.size() <= size) return text;
  while (size > 0 && IsContinuation(text[size])) --size;
  return text.substr(0, size);
}

}  // namespace axlecast
