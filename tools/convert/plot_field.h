#pragma once

#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <string_view>

namespace axlecast {

// What one curve shows: a channel, and a field of its messages by its name in JSON.
struct PlotField {
  std::string channel;
  std::string field;
  [[nodiscard]] std::string Name() const { return channel + ':' + field; }
};

// Of "POSITION/axis1:value" or "MOTOR/gm1:accel_mps2[0]"; nothing when it is not written so.
[[nodiscard]] std::optional<PlotField> ParsePlotField(std::string_view text);

// The field's unit, for people: as the message says ("mm" of a position's `value`), else by the ending of its name
// ("°C" of temperature_c); empty when there is none.
[[nodiscard]] std::string FieldUnit(const nlohmann::ordered_json& message, std::string_view field);

}  // namespace axlecast
