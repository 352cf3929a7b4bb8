// Any settings and any frame: the decoder must answer with an object of docs/decode.md that can be printed.
#include <fuzzer/FuzzedDataProvider.h>

#include <cstdlib>
#include <nlohmann/json.hpp>
#include <vector>

#include "drivers/biss/decode.h"

namespace {

using Json = nlohmann::ordered_json;

void Require(bool holds) {
  if (!holds) std::abort();
}

void CheckObject(const Json& json) {
  const bool ok = json.at("ok").get<bool>();
  Require(json.at("kind") == "position_frame" || json.at("kind") == "transfer");
  Require(json.contains("error") == !ok && json.contains("counts") == ok && json.contains("alarms") == ok);
  if (ok) Require(json.at("angle_deg") >= 0.0 && json["angle_deg"] < 360.0);
  (void)json.dump();
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  FuzzedDataProvider input(data, size);
  axlecast::DecodeSettings settings;
  while (settings.size() < 8 && input.ConsumeBool()) {
    const char* key = input.PickValueInArray(
        {"bits", "turn_bits", "crc_bits", "crc_poly", "crc_start", "crc_inverted", "frame", "bit_count", "other"});
    const std::string words[] = {"true",
                                 "false",
                                 "position",
                                 "transfer",
                                 input.ConsumeRandomLengthString(8),
                                 std::to_string(input.ConsumeIntegral<std::uint8_t>())};
    settings.emplace_back(key, input.PickValueInArray(words));
  }
  const auto frame = input.ConsumeRemainingBytes<std::uint8_t>();
  bool usable = false;
  const Json json = axlecast::biss::Decode(settings, frame, &usable);
  if (usable) {
    CheckObject(json);
  } else {
    Require(!json.at("error").get<std::string>().empty());
  }
  return 0;
}
