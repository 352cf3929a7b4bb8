#include "tools/convert/csv_line.h"

#include <charconv>
#include <string_view>
#include <system_error>

#include "core/base/safe_text.h"

namespace axlecast {
namespace {

bool IsNumber(std::string_view cell) {
  double value = 0;
  const auto [end, error] = std::from_chars(cell.data(), cell.data() + cell.size(), value);
  return error == std::errc() && end == cell.data() + cell.size();
}

// As OWASP's "CSV Injection" has it.
bool IsFormula(std::string_view cell) {
  constexpr std::string_view kBeginnings = "=+-@\t\r";
  return !cell.empty() && kBeginnings.find(cell.front()) != std::string_view::npos && !IsNumber(cell);
}

void AppendCell(std::string& line, std::string_view cell) {
  if (cell.find_first_of(",\"\r\n") == std::string_view::npos) {
    line += cell;
    return;
  }
  line += '"';
  for (const char c : cell) {
    if (c == '"') line += '"';
    line += c;
  }
  line += '"';
}

}  // namespace

std::string CsvLine(const std::vector<std::string>& cells) {
  constexpr std::string_view kReplacement = "\xEF\xBF\xBD";
  std::string line;
  for (std::size_t i = 0; i < cells.size(); ++i) {
    if (i > 0) line += ',';
    std::string text = MendedUtf8(cells[i]);
    for (std::size_t at = 0; (at = text.find('\0', at)) != std::string::npos; at += kReplacement.size()) {
      text.replace(at, 1, kReplacement);
    }
    AppendCell(line, IsFormula(text) ? '\'' + text : text);
  }
  return line + "\r\n";
}

}  // namespace axlecast
