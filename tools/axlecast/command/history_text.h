#pragma once

#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "bridge/store/history.h"

namespace axlecast {

// What `axlecast history` says (docs/cli.md). Pure.

[[nodiscard]] std::string HistoryHeading();
// One line each.
[[nodiscard]] std::string HistoryLine(const CommandRow& command);
[[nodiscard]] std::string HistoryLine(const AxisEvent& event);
// One command whole.
[[nodiscard]] std::string CommandText(const CommandRow& command, const std::vector<CommandStep>& steps);

[[nodiscard]] nlohmann::ordered_json HistoryJson(const CommandRow& command);
[[nodiscard]] nlohmann::ordered_json HistoryJson(const AxisEvent& event);
[[nodiscard]] nlohmann::ordered_json CommandJson(const CommandRow& command, const std::vector<CommandStep>& steps);

// The first 8 digits of an id; "-" without one.
[[nodiscard]] std::string ShortId(const CommandId& id);

}  // namespace axlecast
