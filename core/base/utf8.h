#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <string_view>

namespace axlecast {

// UTF-8 as RFC 3629 defines it: overlong forms, surrogates and codes above U+10FFFF are not UTF-8.

struct Utf8Character {
  char32_t code = 0;
  std::size_t size = 0;  // bytes; 0: the text does not begin with a character of UTF-8
};

// Returns the first character of `text`, which must not be empty.
[[nodiscard]] Utf8Character FirstCharacter(std::string_view text);

// Returns the bytes of the character that begins with `lead`, 1 to 4; 0 if no character begins so.
[[nodiscard]] std::size_t CharacterSize(std::uint8_t lead);

// Returns true for the second to last byte of a character.
[[nodiscard]] constexpr bool IsContinuation(char byte) {
  return (static_cast<std::uint8_t>(byte) & 0xC0U) == 0x80U;
}

// Returns the beginning of `text`, at most `size` bytes, that ends between two characters.
[[nodiscard]] constexpr std::string_view Shortened(std::string_view text, std::size_t size) {
  if (text.size() <= size) return text;
  while (size > 0 && IsContinuation(text[size])) --size;
  return text.substr(0, size);
}

// Returns the text with U+FFFD in place of what is not UTF-8.
[[nodiscard]] std::string MendedUtf8(std::string_view text);

}  // namespace axlecast
