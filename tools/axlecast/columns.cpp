#include "tools/axlecast/columns.h"

#include <array>
#include <cmath>
#include <cstdio>

namespace axlecast {

std::string Printable(std::string_view text) {
  std::string printable(text);
  for (char& character : printable) {
    if (character < ' ' || character > '~') character = '?';
  }
  return printable;
}

std::string Clip(std::string_view text, std::size_t width) {
  if (text.size() <= width) return std::string(text);
  if (width == 0) return "";
  return std::string(text.substr(0, width - 1)) + '~';
}

std::string Left(std::string_view text, std::size_t width) {
  std::string column = Clip(text, width);
  column.resize(width, ' ');
  return column;
}

std::string Right(std::string_view text, std::size_t width) {
  const std::string column = Clip(text, width);
  return std::string(width - column.size(), ' ') + column;
}

std::string Decimal(double value, int decimals) {
  if (!std::isfinite(value)) return "-";
  std::array<char, 64> text{};
  const char* format = std::abs(value) < 1e12 ? "%.*f" : "%.*e";
  static_cast<void>(std::snprintf(text.data(), text.size(), format, decimals, value));
  return text.data();
}

}  // namespace axlecast
