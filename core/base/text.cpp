#include "core/base/text.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdarg>
#include <cstdio>
#include <nlohmann/json.hpp>
#include <utility>

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

// U+FFFE and U+FFFF, which XML 1.0, 2.2, leaves out.
std::string WithoutNoncharacters(std::string text) {
  for (const std::string_view code : {"\xEF\xBF\xBE", "\xEF\xBF\xBF"}) {
    for (std::size_t at = 0; (at = text.find(code, at)) != std::string::npos;) text.replace(at, 3, "\xEF\xBF\xBD");
  }
  return text;
}

// Characters of UTF-8; each takes one column.
std::size_t Width(std::string_view text) {
  return static_cast<std::size_t>(std::count_if(
      text.begin(), text.end(), [](char c) { return (static_cast<unsigned char>(c) & 0xC0U) != 0x80U; }));
}

}  // namespace

std::size_t CharacterSize(std::uint8_t lead) {
  if (lead < 0x80) return 1;
  if (lead >= 0xC2 && lead <= 0xDF) return 2;
  if (lead >= 0xE0 && lead <= 0xEF) return 3;
  return lead >= 0xF0 && lead <= 0xF4 ? 4 : 0;
}

Utf8Character FirstCharacter(std::string_view text) {
  const auto lead = static_cast<std::uint8_t>(text.front());
  const std::size_t size = CharacterSize(lead);
  if (size == 1) return {lead, 1};
  if (size == 0 || text.size() < size) return {};
  char32_t code = lead & (0xFFU >> (size + 1));
  for (const char byte : text.substr(1, size - 1)) {
    if (!IsContinuation(byte)) return {};
    code = code << 6U | (static_cast<std::uint8_t>(byte) & 0x3FU);
  }
  const bool overlong = (size == 3 && code < 0x800) || (size == 4 && code < 0x10000);
  const bool surrogate = code >= 0xD800 && code <= 0xDFFF;
  if (overlong || surrogate || code > 0x10FFFF) return {};
  return {code, size};
}

// By the JSON library, whose strings are UTF-8.
std::string MendedUtf8(std::string_view text) {
  using Json = nlohmann::json;
  const bool ascii = std::all_of(text.begin(), text.end(), [](char c) { return (c & 0x80) == 0; });
  if (ascii) return std::string(text);
  return Json::parse(Json(text).dump(-1, ' ', false, Json::error_handler_t::replace)).get<std::string>();
}

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

std::string EscapedMarkup(std::string_view text) {
  static constexpr std::array<std::pair<char, std::string_view>, 5> kEscapes = {
      {{'&', "&amp;"}, {'<', "&lt;"}, {'>', "&gt;"}, {'"', "&quot;"}, {'\'', "&#39;"}}};
  std::string escaped;
  for (const char c : WithoutNoncharacters(TerminalText(MendedUtf8(text)))) {
    const auto* const escape =
        std::find_if(kEscapes.begin(), kEscapes.end(), [c](const auto& known) { return known.first == c; });
    escaped += escape == kEscapes.end() ? std::string_view(&c, 1) : escape->second;
  }
  return escaped;
}

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
