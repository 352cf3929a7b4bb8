#include "core/base/text.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdarg>
#include <cstdint>
#include <cstdio>

#include "core/base/safe_text.h"

namespace axlecast {
namespace {

// Characters of UTF-8; each takes one column.
std::size_t Width(std::string_view text) {
  return static_cast<std::size_t>(std::count_if(
      text.begin(), text.end(), [](char c) { return (static_cast<unsigned char>(c) & 0xC0U) != 0x80U; }));
}

}  // namespace

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

std::string Printable(std::string_view text) {
  std::string printable;
  while (!text.empty()) {
    const bool cut_mark = text.starts_with(kCutMark);
    const bool shown = text[0] >= ' ' && text[0] <= '~';
    printable += cut_mark ? kCutMark : shown ? text.substr(0, 1) : std::string_view("?");
    text.remove_prefix(cut_mark ? kCutMark.size() : 1);
  }
  return printable;
}

std::string Clip(std::string_view text, std::size_t width) {
  if (Width(text) <= width) return std::string(text);
  if (width == 0) return "";
  return CutText(text, width - 1);  // the mark takes one column
}

std::string Left(std::string_view text, std::size_t width) {
  const std::string column = Clip(text, width);
  return column + std::string(width - Width(column), ' ');
}

std::string Right(std::string_view text, std::size_t width) {
  const std::string column = Clip(text, width);
  return std::string(width - Width(column), ' ') + column;
}

std::string Decimal(double value, int decimals) {
  if (!std::isfinite(value)) return "-";
  std::array<char, 64> text{};
  const char* format = std::abs(value) < 1e12 ? "%.*f" : "%.*e";
  static_cast<void>(std::snprintf(text.data(), text.size(), format, decimals, value));
  return text.data();
}

std::string Text(const char* format, ...) {
  std::array<char, 201> buffer{};
  std::va_list arguments;
  va_start(arguments, format);
  std::vsnprintf(buffer.data(), buffer.size(), format, arguments);
  va_end(arguments);
  return buffer.data();
}

std::string HexDigits(Bytes bytes) {
  constexpr std::string_view kDigits = "0123456789abcdef";
  std::string text;
  text.reserve(2 * bytes.size());
  for (const std::uint8_t byte : bytes) {
    text += kDigits[byte >> 4U];
    text += kDigits[byte & 0xFU];
  }
  return text;
}

std::string HexText(Bytes bytes) {
  std::string text;
  for (const std::uint8_t byte : bytes) {
    if (!text.empty()) text += ' ';
    text += Text("%02X", unsigned{byte});
  }
  return text;
}

std::string ShellText(const std::vector<std::string>& words) {
  constexpr std::string_view kPlain = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789_-./:=,+@%";
  std::string text;
  for (const std::string& word : words) {
    if (!text.empty()) text += ' ';
    if (!word.empty() && word.find_first_not_of(kPlain) == std::string::npos) {
      text += word;
      continue;
    }
    text += '\'';
    for (const char character : word) text += character == '\'' ? std::string("'\\''") : std::string(1, character);
    text += '\'';
  }
  return text;
}

}  // namespace axlecast
