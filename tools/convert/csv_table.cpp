#include "tools/convert/csv_table.h"

#include <map>
#include <optional>
#include <string>
#include <vector>

#include "core/messages/json/field.h"
#include "core/messages/json/message_json.h"
#include "tools/convert/csv_line.h"
#include "tools/convert/flat_fields.h"

namespace axlecast {
namespace {

// The columns by name, in the order in which they were seen.
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

std::optional<nlohmann::ordered_json> Decoded(const LogEvent& event) {
  std::string type;
  return DecodeToJson(event.data, &type);
}

Columns FindColumns(const EventRange& events) {
  Columns columns;
  std::map<std::string_view, bool> same;  // by type, once one was seen
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

Conversion WriteCsvTable(const EventRange& events, const Output& out) {
  Conversion done;
  const Columns columns = FindColumns(events);
  if (!out(CsvLine(columns.names()))) return done;
  std::vector<std::string> cells;
  events([&](const LogEvent& event) {
    const auto message = Decoded(event);
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
