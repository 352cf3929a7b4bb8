#include "tools/convert/csv.h"

#include <charconv>
#include <map>
#include <optional>
#include <string_view>
#include <system_error>

#include "core/base/text.h"
#include "core/messages/json/field.h"
#include "core/messages/json/message_json.h"
#include "tools/convert/conversion.h"

namespace axlecast {
namespace {

bool IsNumber(std::string_view cell) {
  double value = 0;
  const auto [end, error] = std::from_chars(cell.data(), cell.data() + cell.size(), value);
  return error == std::errc() && end == cell.data() + cell.size();
}

// Detects the cells that OWASP's "CSV Injection" lists.
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

// The columns by name, in the order of their first occurrence.
class Columns {
 public:
  Columns() {
    Add("log_utime");
    Add("channel");
  }
  void Add(const std::string& name) {
    if (places_.emplace(name, names_.size()).second) names_.push_back(name);
  }
  [[nodiscard]] const std::vector<std::string>& names() const { return names_; }
  [[nodiscard]] std::size_t Place(const std::string& name) const { return places_.at(name); }

 private:
  std::vector<std::string> names_;
  std::map<std::string, std::size_t> places_;
};

Columns FindColumns(const EventRange& events) {
  Columns columns;
  std::map<std::string_view, bool> same;  // by type of message: all messages have the same fields
  events([&](const LogEvent& event) {
    const MessageType* const type = FindMessageType(event.data);
    if (type == nullptr) return true;
    const auto seen = same.find(type->name);
    if (seen != same.end() && seen->second) return true;
    const auto message = type->decode(event.data);
    if (!message) return true;
    VisitFields(*message, [&](const std::string& name, const auto&) { columns.Add(name); });
    if (seen == same.end()) same[type->name] = AlwaysSameFields(type->schema);
    return true;
  });
  return columns;
}

std::string CellText(const nlohmann::ordered_json& value) {
  if (value.is_null()) return "";
  return value.is_string() ? value.get<std::string>() : value.dump();
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

Conversion WriteCsvTable(const EventRange& events, const Output& out) {
  Conversion done;
  const Columns columns = FindColumns(events);
  if (!out(CsvLine(columns.names()))) return done;
  std::vector<std::string> cells;
  events([&](const LogEvent& event) {
    std::string type;
    const auto message = DecodeToJson(event.data, &type);
    if (!message) {
      ++done.left_out;
      return true;
    }
    cells.assign(columns.names().size(), "");
    VisitFields(*message,
                [&](const std::string& name, const auto& value) { cells[columns.Place(name)] = CellText(value); });
    cells[0] = std::to_string(event.utime);
    cells[1] = event.channel;
    ++done.written;
    return out(CsvLine(cells));
  });
  return done;
}

}  // namespace axlecast
