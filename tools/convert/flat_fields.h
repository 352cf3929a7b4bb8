#pragma once

#include <functional>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <string_view>

namespace axlecast {

// A message's JSON as one list of names and plain values: "value", "spare[1]", "entries[0].code". The names of flags are
// one value: "valid turns_valid".
using FieldVisitor = std::function<void(const std::string& name, const nlohmann::ordered_json& value)>;
void VisitFields(const nlohmann::ordered_json& message, const FieldVisitor& visit);

// The value of that name; null when the message has none of it.
[[nodiscard]] const nlohmann::ordered_json* FindField(const nlohmann::ordered_json& message, std::string_view name);

// True when every message of the type has the same names: its schema holds no list whose length differs, and no
// message within it that may be missing.
[[nodiscard]] bool AlwaysSameFields(std::string_view schema);

}  // namespace axlecast
