#pragma once

#include <cstdint>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <string_view>

#include "core/base/inline_bytes.h"

namespace axlecast {

// The messages as brokers get them: every field under its name, words beside the numbers that are words, and without
// what is for LCM alone (spare, signatures) or nobody's business (tokens). docs/mqtt.md, docs/mqtt.schema.json.

// The message's JSON; nothing when it is none of this type.
[[nodiscard]] std::optional<nlohmann::ordered_json> MqttPayload(std::string_view type, Bytes message);

// The longest that is published, as text. What comes in one datagram of LCM is shorter.
inline constexpr std::size_t kLongestPayload = 16 << 10;

}  // namespace axlecast
