#pragma once

#include <cstdint>
#include <nlohmann/json.hpp>
#include <string>
#include <string_view>
#include <vector>

#include "bridge/store/history.h"
#include "core/config/machine_config.h"

namespace axlecast {

// The texts of `axlecast history` and `axlecast datum` (docs/cli.md).

[[nodiscard]] std::string HistoryHeading();
// Format one line.
[[nodiscard]] std::string HistoryLine(const CommandRow& command);
[[nodiscard]] std::string HistoryLine(const AxisEvent& event);
// Formats one command with all its steps.
[[nodiscard]] std::string CommandText(const CommandRow& command, const std::vector<CommandStep>& steps);

[[nodiscard]] nlohmann::ordered_json HistoryJson(const CommandRow& command);
[[nodiscard]] nlohmann::ordered_json HistoryJson(const AxisEvent& event);
[[nodiscard]] nlohmann::ordered_json CommandJson(const CommandRow& command, const std::vector<CommandStep>& steps);

// Returns the number of memory writes that the maker specifies for the device, or 0 if it is unknown.
[[nodiscard]] std::int64_t WriteBudget(const MachineConfig& machine, std::string_view device);

// `write_budget`: see WriteBudget.
[[nodiscard]] std::string DatumText(const DeviceRecord& device, std::int64_t write_budget);
[[nodiscard]] nlohmann::ordered_json DatumJson(const DeviceRecord& device, std::int64_t write_budget);

[[nodiscard]] std::string DatumHistoryHeading();
[[nodiscard]] std::string DatumHistoryLine(const DatumHistory& entry);
[[nodiscard]] nlohmann::ordered_json DatumHistoryJson(const std::string& device, const DatumHistory& entry);

}  // namespace axlecast
