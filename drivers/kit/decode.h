#pragma once

#include <algorithm>
#include <cstdint>
#include <functional>
#include <initializer_list>
#include <nlohmann/json.hpp>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "core/base/result.h"
#include "core/device/family.h"
#include "drivers/kit/arguments.h"

// Common parts of Family::decode: its settings, and its JSON object (docs/decode.md).
namespace axlecast {

// One setting of a family.
struct DecodeOption {
  std::string_view key;
  std::string expected;                               // the values that are right
  std::function<bool(const std::string& value)> set;  // returns false if the value is wrong
};

// A number from `min` to `max`. `into` outlives the option.
template <typename Number>
[[nodiscard]] DecodeOption NumberOption(std::string_view key, Number& into, std::int64_t min, std::int64_t max,
                                        std::string_view meaning = "") {
  std::string expected = std::to_string(min) + ".." + std::to_string(max);
  if (!meaning.empty()) expected.append(", ").append(meaning);
  return {key, std::move(expected), [&into, min, max](const std::string& value) {
            const std::optional<std::int64_t> number = ParseWhole(value, min, max);
            if constexpr (requires { into.reset(); }) {
              if (number) into = static_cast<typename Number::value_type>(*number);
            } else {
              if (number) into = static_cast<Number>(*number);
            }
            return number.has_value();
          }};
}

// One of `words`. The value is the index of the word.
template <typename Value>
[[nodiscard]] DecodeOption ChoiceOption(std::string_view key, Value& into,
                                        std::initializer_list<std::string_view> words) {
  std::string expected;
  for (const std::string_view word : words) expected.append(expected.empty() ? "" : " or ").append(word);
  return {key, std::move(expected), [&into, list = std::vector(words)](const std::string& value) {
            for (std::size_t i = 0; i < list.size(); ++i) {
              if (list[i] == value) into = static_cast<Value>(i);
            }
            return std::find(list.begin(), list.end(), value) != list.end();
          }};
}

// Applies the settings in their order. Fails for a key that is not among `options`, and for a wrong value.
[[nodiscard]] Result<> ApplySettings(std::string_view family, const DecodeSettings& settings,
                                     std::span<const DecodeOption> options);

[[nodiscard]] inline nlohmann::ordered_json BadFrame(std::string_view kind, std::string_view error) {
  return {{"ok", false}, {"kind", kind}, {"error", error}};
}
[[nodiscard]] std::string HexByte(std::uint8_t byte);  // "0x0f"

}  // namespace axlecast
