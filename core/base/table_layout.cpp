#include "core/base/table_layout.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>

#include "core/base/truncated_text.h"

namespace axlecast {

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

namespace {

// Characters of UTF-8; each takes one column.
std::size_t Width(std::string_view text) {
  return static_cast<std::size_t>(std::count_if(
      text.begin(), text.end(), [](char c) { return (static_cast<unsigned char>(c) & 0xC0U) != 0x80U; }));
}

}  // namespace

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

}  // namespace axlecast
