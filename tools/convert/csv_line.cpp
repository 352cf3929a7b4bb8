#include "tools/convert/csv_line.h"

#include <string_view>

#include "tools/text/utf8.h"

namespace axlecast {
namespace {

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
    AppendCell(line, text);
  }
  return line + "\r\n";
}

}  // namespace axlecast
