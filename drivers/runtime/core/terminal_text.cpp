#include "drivers/runtime/core/terminal_text.h"

#include <algorithm>
#include <cstdint>

#include "drivers/runtime/core/utf8.h"

namespace axlecast {
namespace {

constexpr char32_t kReplacement = 0xFFFD;

bool IsUnsafe(char32_t code) {
  if (code < 0x20) return code != '\t' && code != '\n';
  if (code >= 0x7F && code <= 0x9F) return true;
  return code == 0x061C || code == 0x200E || code == 0x200F || (code >= 0x2028 && code <= 0x202E) ||
         (code >= 0x2066 && code <= 0x2069);
}

}  // namespace

std::optional<UnsafePart> FindUnsafe(std::string_view text, std::size_t from) {
  while (from < text.size()) {
    const auto byte = static_cast<std::uint8_t>(text[from]);
    if (byte >= 0x20 && byte < 0x7F) {
      ++from;
      continue;
    }
    const Utf8Character character = FirstCharacter(text.substr(from));
    if (character.size == 0) return UnsafePart{from, 1, kReplacement};
    if (IsUnsafe(character.code)) return UnsafePart{from, character.size, character.code};
    from += character.size;
  }
  return std::nullopt;
}

std::string TerminalText(std::string_view text) {
  std::string safe;
  std::size_t done = 0;
  while (const auto part = FindUnsafe(text, done)) {
    safe += text.substr(done, part->begin - done);
    safe += "\xEF\xBF\xBD";
    done = part->begin + part->size;
  }
  return safe += text.substr(done);
}

std::size_t UnfinishedBytes(std::string_view text) {
  const std::size_t most = std::min<std::size_t>(text.size(), 3);
  for (std::size_t size = 1; size <= most; ++size) {
    const auto byte = static_cast<std::uint8_t>(text[text.size() - size]);
    if (!IsContinuation(text[text.size() - size])) return CharacterSize(byte) > size ? size : 0;
  }
  return 0;
}

}  // namespace axlecast
