#include "core/messages/json/field.h"

#include <cmath>

#include "core/messages/message.h"

namespace axlecast {

nlohmann::ordered_json Field(double value) {
  if (!std::isfinite(value)) return nullptr;
  return value;
}

nlohmann::ordered_json NameField(std::int64_t number, NumberNames names) {
  for (const NumberName& known : names) {
    if (known.number == number) return known.name;
  }
  return nullptr;
}

nlohmann::ordered_json CountsByName(std::span<const std::int64_t> counts, NumberNames names) {
  nlohmann::ordered_json object = nlohmann::ordered_json::object();
  for (const NumberName& known : names)
    object[std::string(known.name)] = counts[static_cast<std::size_t>(known.number)];
  return object;
}

std::optional<std::int64_t> Fingerprint(Bytes message) {
  if (message.size() < 8) return std::nullopt;
  return ReadInt64(message, 0);
}

std::optional<MessageHead> ReadHead(Bytes message) {
  if (message.size() < 56) return std::nullopt;
  return MessageHead{.utime = ReadInt64(message, 8),
                     .mono_ns = ReadInt64(message, 16),
                     .boot_id = ReadInt64(message, 24),
                     .seq = ReadInt64(message, 32),
                     .machine_id = ReadInt64(message, 40),
                     .clock_id = ReadInt64(message, 48)};
}

nlohmann::ordered_json ParseOutsideJson(std::string_view text) {
  using Json = nlohmann::ordered_json;
  const auto shallow = [](int depth, Json::parse_event_t, Json&) { return depth < kDeepestJson; };
  return Json::parse(text, shallow, false);
}

// What could steer a terminal is escaped, which changes no value: JSON goes to terminals too.
std::string JsonLine(const nlohmann::ordered_json& json) {
  const std::string text = json.dump(-1, ' ', false, nlohmann::ordered_json::error_handler_t::replace);
  std::string line;
  std::size_t done = 0;
  while (const auto part = FindUnsafe(text, done)) {
    line += text.substr(done, part->begin - done) + Text("\\u%04x", static_cast<unsigned>(part->code));
    done = part->begin + part->size;
  }
  return line + text.substr(done);
}

}  // namespace axlecast
