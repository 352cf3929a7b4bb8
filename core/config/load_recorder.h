#pragma once

#include "core/config/config_map.h"
#include "core/config/recorder_config.h"

namespace axlecast {

// Reads `recorder`: the logs that are written of the machine.
[[nodiscard]] RecorderConfig LoadRecorder(ConfigMap map);

}  // namespace axlecast
