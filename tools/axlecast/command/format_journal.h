#pragma once

#include <cstdint>
#include <nlohmann/json.hpp>
#include <string>
#include <string_view>
#include <vector>

#include "bridge/store/history.h"
#include "core/config/machine_config.h"

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

// What `axlecast datum` says (docs/cli.md). Pure.

// Rewrites of the device's memory that its maker allows; 0 none stated, or no such device.
[[nodiscard]] std::int64_t WriteBudget(const MachineConfig& machine, std::string_view device);

// `write_budget`: rewrites of the device's memory that its maker allows; 0 none stated, or not known.
[[nodiscard]] std::string DatumText(const DeviceRecord& device, std::int64_t write_budget);
[[nodiscard]] nlohmann::ordered_json DatumJson(const DeviceRecord& device, std::int64_t write_budget);

[[nodiscard]] std::string DatumHistoryHeading();
[[nodiscard]] std::string DatumHistoryLine(const DatumHistory& entry);
[[nodiscard]] nlohmann::ordered_json DatumHistoryJson(const std::string& device, const DatumHistory& entry);

}  // namespace axlecast
