#pragma once

#include <cstdint>
#include <functional>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <string_view>

#include "tools/log/log_event.h"

namespace axlecast {

// Calls a visitor with every selected event of a log, in order, until the visitor returns false. It can be called several
// times and shows the same events each time.
using EventVisitor = std::function<bool(const LogEvent&)>;
using EventRange = std::function<void(const EventVisitor&)>;

// Takes the next part of the output. Returns false if it cannot be written; then the conversion ends.
using Output = std::function<bool(std::string_view)>;

// The result of a conversion.
struct Conversion {
  std::int64_t written = 0;   // messages, frames or rows
  std::int64_t left_out = 0;  // malformed events, and events that the format cannot contain
  std::string note;           // a limitation that the reader of the output should know; empty: none
};

// Returns the time of the event's message, in us of UNIX time: its `utime` if it has one between 1970 and 9999, else the
// time of its reception. The message is not decoded and may be malformed.
[[nodiscard]] std::int64_t SampleTime(const LogEvent& event);

// Calls `visit` with the name and value of each plain value of a message's JSON: "value", "spare[1]", "entries[0].code". The names
// of flags are one value: "valid turns_valid".
using FieldVisitor = std::function<void(const std::string& name, const nlohmann::ordered_json& value)>;
void VisitFields(const nlohmann::ordered_json& message, const FieldVisitor& visit);

// Returns the value with this name, or null if the message does not contain it.
[[nodiscard]] const nlohmann::ordered_json* FindField(const nlohmann::ordered_json& message, std::string_view name);

// Returns true if every message of the type has the same names: its schema contains no list of variable length, and no
// message that may be missing.
[[nodiscard]] bool AlwaysSameFields(std::string_view schema);

}  // namespace axlecast
