#pragma once

#include <concepts>
#include <cstddef>
#include <cstdint>
#include <nlohmann/json.hpp>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "core/base/inline_bytes.h"
#include "core/base/text.h"
#include "core/messages/enum_names.h"
#include "core/messages/message.h"

namespace axlecast {

// How the values of LCM messages look in JSON; used by the generated message_json.cpp.

[[nodiscard]] inline nlohmann::ordered_json Field(std::integral auto value) {
  return static_cast<std::int64_t>(value);
}
[[nodiscard]] nlohmann::ordered_json Field(double value);  // null unless finite
[[nodiscard]] inline nlohmann::ordered_json Field(const std::string& value) { return value; }

[[nodiscard]] inline nlohmann::ordered_json IdField(std::int64_t id) {
  return Text("%016llx", static_cast<unsigned long long>(id));
}
[[nodiscard]] inline nlohmann::ordered_json HexField(Bytes bytes) { return HexDigits(bytes); }

// The number's name; null when it has none, e.g. that of a newer version.
[[nodiscard]] nlohmann::ordered_json NameField(std::int64_t number, NumberNames names);
// The names of the bits that are set; bits without a name as one hexadecimal number at the end.
[[nodiscard]] inline nlohmann::ordered_json BitNamesField(std::uint32_t bits, NumberNames names) {
  return BitNames(bits, names);
}
template <typename Numbers>
requires requires(const Numbers& numbers) { numbers[0]; }
[[nodiscard]] nlohmann::ordered_json BitNamesField(const Numbers& numbers, NumberNames names) {
  nlohmann::ordered_json list = nlohmann::ordered_json::array();
  for (const std::int32_t bits : numbers) list.push_back(BitNamesField(static_cast<std::uint32_t>(bits), names));
  return list;
}
// Each of the counters under the name of its index.
[[nodiscard]] nlohmann::ordered_json CountsByName(std::span<const std::int64_t> counts, NumberNames names);

// A message within a message.
template <typename Message>
requires requires(const Message& message) { ToJson(message); }
[[nodiscard]] nlohmann::ordered_json Field(const Message& message) { return ToJson(message); }

template <typename Value>
[[nodiscard]] nlohmann::ordered_json Field(const std::vector<Value>& values);

template <typename Value, std::size_t N>
[[nodiscard]] nlohmann::ordered_json Field(const Value (&values)[N]) {
  nlohmann::ordered_json list = nlohmann::ordered_json::array();
  for (const Value& value : values) list.push_back(Field(value));
  return list;
}

template <typename Value>
[[nodiscard]] nlohmann::ordered_json Field(const std::vector<Value>& values) {
  nlohmann::ordered_json list = nlohmann::ordered_json::array();
  for (const Value& value : values) list.push_back(Field(value));
  return list;
}

template <typename Message>
[[nodiscard]] std::optional<nlohmann::ordered_json> DecodeField(Bytes bytes) {
  const std::optional<Message> message = DecodeMessage<Message>(bytes);
  if (!message) return std::nullopt;
  return ToJson(*message);
}

// The message that `bytes` encode; null when they do not.
template <typename Message>
[[nodiscard]] nlohmann::ordered_json DecodedField(Bytes bytes) {
  return DecodeField<Message>(bytes).value_or(nullptr);
}

// The first 8 bytes of an encoded message: LCM's hash of its type.
[[nodiscard]] std::optional<std::int64_t> Fingerprint(Bytes message);

// What every published type begins with (lcmtypes/).
struct MessageHead {
  std::int64_t utime = 0;    // us, UNIX time
  std::int64_t mono_ns = 0;  // CLOCK_MONOTONIC of the same instant
  std::int64_t boot_id = 0;
  std::int64_t seq = 0;
  std::int64_t machine_id = 0;
  std::int64_t clock_id = 0;
};

// The head of an encoded message whose type has one; nothing when it is cut.
[[nodiscard]] std::optional<MessageHead> ReadHead(Bytes message);

// What a text from outside holds; `is_discarded()` where it is no JSON. What is nested deeper than kDeepestJson is left
// out: to copy or print it would need a stack as deep.
inline constexpr int kDeepestJson = 16;
[[nodiscard]] nlohmann::ordered_json ParseOutsideJson(std::string_view text);

// One line of text, without the newline. Text that is not UTF-8 (a message may hold any bytes) is
// converted: invalid bytes become U+FFFD.
[[nodiscard]] std::string JsonLine(const nlohmann::ordered_json& json);

}  // namespace axlecast
