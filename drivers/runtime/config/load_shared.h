#pragma once

#include <optional>
#include <string>

#include "drivers/runtime/config/config_map.h"
#include "drivers/runtime/config/machine_config.h"

namespace axlecast {

// As LoadConfig, for a program that examines the machine's host instead of obeying the file: it may be one that others
// can write (OthersMayWriteConfig).
[[nodiscard]] std::optional<MachineConfig> LoadSharedConfig(const std::string& file, ConfigErrors& errors);

}  // namespace axlecast
