#pragma once

#include <nlohmann/json.hpp>
#include <string>

namespace axlecast {

// What matters of a message (of `type`, as DecodeToJson gives it), for a person, in printable ASCII.
[[nodiscard]] std::string Describe(const std::string& type, const nlohmann::ordered_json& message);

}  // namespace axlecast
