#pragma once

#include <optional>
#include <string>

#include "core/config/config_map.h"
#include "core/config/machine_config.h"

namespace axlecast {

// As LoadConfig, for a program that examines the machine's host instead of obeying the file: it may be one that others
// can write (OthersMayWriteConfig).
[[nodiscard]] std::optional<MachineConfig> LoadSharedConfig(const std::string& file, ConfigErrors& errors);

}  // namespace axlecast
