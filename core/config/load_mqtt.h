#pragma once

#include "core/config/config_map.h"
#include "core/config/mqtt_config.h"

namespace axlecast {

// Reads `mqtt`: the broker that the machine's messages go to. `devices`: those of the machine.
[[nodiscard]] MqttConfig LoadMqtt(ConfigMap map, const std::vector<std::string>& devices);

}  // namespace axlecast
