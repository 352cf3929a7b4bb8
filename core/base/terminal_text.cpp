#include "core/base/terminal_text.h"

#include <algorithm>
#include <cstdint>

#include "core/base/utf8.h"

namespace axlecast {
namespace {

constexpr char32_t kReplacement = 0xFFFD;

bool IsWithin(char32_t code, char32_t first, char32_t last) { return code >= first && code <= last; }

// Characters without width, annotations and tags. Some scripts and emoji need the joiners among them.
bool IsHidden(char32_t code) {
  return code == 0xAD || IsWithin(code, 0x200B, 0x200D) || IsWithin(code, 0x2060, 0x2065) ||
         IsWithin(code, 0x206A, 0x206F) || code == 0xFEFF || IsWithin(code, 0xFFF9, 0xFFFB) ||
         IsWithin(code, 0xE0000, 0xE0FFF);
}

bool IsUnsafe(char32_t code, TextShape shape) {
  const bool one_line = shape == TextShape::kOneLine;
  if (code == '\t' || code == '\n') return one_line;
  if (code < 0x20 || IsWithin(code, 0x7F, 0x9F)) return true;
  if (code == 0x061C || IsWithin(code, 0x200E, 0x200F) || IsWithin(code, 0x2028, 0x202E) ||
      IsWithin(code, 0x2066, 0x2069)) {
    return true;
  }
  return one_line && IsHidden(code);
}

}  // namespace

std::optional<UnsafePart> FindUnsafe(std::string_view text, std::size_t from, TextShape shape) {
  while (from < text.size()) {
    const auto byte = static_cast<std::uint8_t>(text[from]);
    if (byte >= 0x20 && byte < 0x7F) {
      ++from;
      continue;
    }
    const Utf8Character character = FirstCharacter(text.substr(from));
    if (character.size == 0) return UnsafePart{from, 1, kReplacement};
    if (IsUnsafe(character.code, shape)) return UnsafePart{from, character.size, character.code};
    from += character.size;
  }
  return std::nullopt;
}

std::string TerminalText(std::string_view text, TextShape shape) {
  std::string safe;
  std::size_t done = 0;
  while (const auto part = FindUnsafe(text, done, shape)) {
    safe += text.substr(done, part->begin - done);
    safe += "\xEF\xBF\xBD";
    done = part->begin + part->size;
  }
  return safe += text.substr(done);
}

std::size_t UnfinishedBytes(std::string_view text) {
  const std::size_t maximum = std::min<std::size_t>(text.size(), 3);
  for (std::size_t size = 1; size <= maximum; ++size) {
    const auto byte = static_cast<std::uint8_t>(text[text.size() - size]);
    if (!IsContinuation(text[text.size() - size])) return CharacterSize(byte) > size ? size : 0;
  }
  return 0;
}

}  // namespace axlecast
