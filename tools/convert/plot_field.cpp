#include "tools/convert/plot_field.h"

#include <utility>

#include "core/messages/enum_names.h"

namespace axlecast {
namespace {

// Longer endings first.
constexpr std::pair<std::string_view, std::string_view> kUnits[] = {
    {"_rad_s", "rad/s"}, {"_rad", "rad"}, {"_mps2", "m/s²"},    {"bytes_hz", "B/s"},
    {"_hz", "Hz"},       {"_bytes", "B"}, {"_ns", "ns"},        {"_us", "µs"},
    {"_ms", "ms"},       {"_v", "V"},     {"_a", "A"},          {"_w", "W"},
    {"_c", "°C"},        {"utime", "µs"}, {"counts", "counts"}, {"raw_turns", "turns"}};

}  // namespace

std::optional<PlotField> ParsePlotField(std::string_view text) {
  const std::size_t colon = text.rfind(':');
  if (colon == std::string_view::npos || colon == 0 || colon + 1 == text.size()) return std::nullopt;
  return PlotField{std::string(text.substr(0, colon)), std::string(text.substr(colon + 1))};
}

std::string FieldUnit(const nlohmann::ordered_json& message, std::string_view field) {
  const auto unit = message.find("unit");
  if (field == "value" && unit != message.end() && unit->is_number_integer()) {
    return std::string(UnitName(unit->get<std::int8_t>()));
  }
  const std::string_view name = field.substr(0, field.find('['));
  for (const auto& [ending, text] : kUnits) {
    if (name.ends_with(ending)) return std::string(text);
  }
  return "";
}

}  // namespace axlecast
