#pragma once

#include <nlohmann/json.hpp>
#include <string>
#include <string_view>

#include "core/config/machine_config.h"
#include "tools/monitor/machine_view.h"

namespace axlecast {

// What `axlecast status` and `axlecast info` say (docs/cli.md). Pure.

[[nodiscard]] std::string StatusText(const MachineView& machine, MonoNs now);
[[nodiscard]] nlohmann::ordered_json StatusJson(const MachineView& machine, MonoNs now);

// What this process lost and refused of LCM's datagrams, as `status --json` and `up --json` show it.
[[nodiscard]] nlohmann::ordered_json ReceptionJson(const ReceptionCounts& counts);

// `device` has its DEVICE message.
[[nodiscard]] std::string InfoText(const DeviceView& device, MonoNs now);
[[nodiscard]] nlohmann::ordered_json InfoJson(const DeviceView& device);

// What the device says now, in one line, so that an operator sees what would be lost.
[[nodiscard]] std::string PresentText(const DeviceView& device, MonoNs now);

// Why `name` is no device of the machine, and which there are.
[[nodiscard]] std::string UnknownDevice(const MachineConfig& machine, std::string_view name);

}  // namespace axlecast
