#pragma once

// What the fuzzers of the families' decoders share: any settings and any frame must be answered with an object of
// docs/decode.md that can be printed.

#include <fuzzer/FuzzedDataProvider.h>

#include <cstdlib>
#include <initializer_list>
#include <nlohmann/json.hpp>
#include <string>

#include "core/device/family.h"

namespace axlecast {

inline void Require(bool holds) {
  if (!holds) std::abort();
}

// A number of one byte, or any text of up to `most` characters.
inline std::string NumberOrText(FuzzedDataProvider& input, std::size_t maximum) {
  return input.ConsumeBool() ? std::to_string(input.ConsumeIntegral<std::uint8_t>())
                             : input.ConsumeRandomLengthString(maximum);
}

// Up to `most` settings, each of one of these keys and what `value(input)` returns.
template <typename Value>
DecodeSettings DrawSettings(FuzzedDataProvider& input, std::size_t maximum,
                            std::initializer_list<const char* const> keys, Value value) {
  DecodeSettings settings;
  while (settings.size() < maximum && input.ConsumeBool()) {
    const char* key = input.PickValueInArray(keys);
    settings.emplace_back(key, value(input));
  }
  return settings;
}

// Requires what docs/decode.md promises for every family; `check(json, ok)` requires what it promises for this one.
template <typename Check>
void CheckDecode(decltype(Family::decode) decode, const DecodeSettings& settings, Bytes frame, Check check) {
  const Result<nlohmann::ordered_json> decoded = decode(settings, frame);
  if (!decoded) return Require(!decoded.error().text.empty());
  const nlohmann::ordered_json& json = *decoded;
  const bool ok = json.at("ok").get<bool>();
  Require(!json.at("kind").get<std::string>().empty());
  Require(json.contains("error") == !ok);
  if (!ok) Require(!json.contains("counts") && !json.contains("turns") && !json.contains("angle_deg"));
  if (json.contains("angle_deg")) Require(json["angle_deg"] >= 0.0 && json["angle_deg"] < 360.0);
  check(json, ok);
  static_cast<void>(json.dump());
}

}  // namespace axlecast
