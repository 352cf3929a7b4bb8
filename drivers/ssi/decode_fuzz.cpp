// Any settings and any frame: the decoder must answer with an object of docs/decode.md that can be printed.
#include <fuzzer/FuzzedDataProvider.h>

#include <cstdlib>
#include <nlohmann/json.hpp>
#include <vector>

#include "drivers/ssi/decode.h"

namespace {

using Json = nlohmann::ordered_json;

void Require(bool holds) {
  if (!holds) std::abort();
}

void CheckObject(const Json& json) {
  const bool ok = json.at("ok").get<bool>();
  Require(json.at("kind") == "position_word");
  Require(json.contains("error") == !ok && json.contains("counts") == ok && json.contains("angle_deg") == ok);
  if (!ok) Require(!json.contains("turns") && !json.contains("alarms"));
  if (ok) Require(json["angle_deg"] >= 0.0 && json["angle_deg"] < 360.0);
  static_cast<void>(json.dump());
}

std::string AnyValue(FuzzedDataProvider& input) {
  switch (input.ConsumeIntegralInRange(0, 3)) {
    case 0:
      return input.ConsumeRandomLengthString(12);
    case 1:
      return input.PickValueInArray({"true", "false", "joint", "separate", "plain", "tree25", "none", "one_zero",
                                     "no_gap", "zero", "repeat", "unchecked", "no_encoder", "position"});
    case 2:
      return std::string(input.PickValueInArray({"even:", "odd:", "alarm:"})) +
             std::to_string(input.ConsumeIntegral<std::uint8_t>());
    default:
      return std::to_string(input.ConsumeIntegral<std::uint8_t>());
  }
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  FuzzedDataProvider input(data, size);
  axlecast::DecodeSettings settings;
  while (settings.size() < 8 && input.ConsumeBool()) {
    const char* key =
        input.PickValueInArray({"bits", "turn_bits", "gray", "halves", "format", "first_bit", "word_bits", "repeat",
                                "words", "trailing", "all_ones", "status", "parity", "bit_count", "other"});
    settings.emplace_back(key, AnyValue(input));
  }
  const auto frame = input.ConsumeRemainingBytes<std::uint8_t>();
  bool usable = false;
  const Json json = axlecast::ssi::Decode(settings, frame, &usable);
  if (usable) {
    CheckObject(json);
  } else {
    Require(!json.at("error").get<std::string>().empty());
    static_cast<void>(json.dump(-1, ' ', false, Json::error_handler_t::replace));
  }
  return 0;
}
