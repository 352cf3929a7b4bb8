#pragma once

#include <nlohmann/json.hpp>

namespace axlecast {

// JSON Schemas (draft 2020-12) of what is published, in "$defs" by the level of the topic behind the machine's: "position",
// "alarm", ... "status". Made from the messages' own (core/messages/json), so that they cannot drift.
[[nodiscard]] nlohmann::ordered_json MqttSchemas();

}  // namespace axlecast
