// Any settings and any packet: the decoder must answer with an object of docs/decode.md that can be printed.
#include <fuzzer/FuzzedDataProvider.h>

#include <cstdlib>
#include <nlohmann/json.hpp>
#include <vector>

#include "drivers/saa_can/decode.h"

namespace {

using Json = nlohmann::ordered_json;

void Require(bool holds) {
  if (!holds) std::abort();
}

void CheckObject(const Json& json) {
  const bool ok = json.at("ok").get<bool>();
  Require(!json.at("kind").get<std::string>().empty());
  Require(json.contains("error") == !ok);
  if (!ok) Require(!json.contains("counts") && !json.contains("angle_deg"));
  if (json.contains("angle_deg")) Require(json["angle_deg"] >= 0.0 && json["angle_deg"] < 360.0);
  (void)json.dump();
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  FuzzedDataProvider input(data, size);
  axlecast::DecodeSettings settings;
  while (settings.size() < 4 && input.ConsumeBool()) {
    const char* key =
        input.PickValueInArray({"bits", "node", "byte_order", "data", "turn_bits", "cob_id", "other"});
    const char* word = input.PickValueInArray({"", "big", "little", "position", "reply"});
    settings.emplace_back(key, *word != 0 ? word : std::to_string(input.ConsumeIntegral<std::uint8_t>()));
  }
  if (input.ConsumeBool()) settings.emplace_back("model", input.ConsumeBool() ? "cia406" : "saa");
  std::vector<std::uint8_t> packet;
  if (input.ConsumeBool()) {
    // Within the identifiers that mean something.
    const int id = input.ConsumeIntegralInRange(0, 0x7FF);
    packet = {0, 0, static_cast<std::uint8_t>(id >> 8), static_cast<std::uint8_t>(id)};
  }
  const auto rest = input.ConsumeRemainingBytes<std::uint8_t>();
  packet.insert(packet.end(), rest.begin(), rest.end());
  bool usable = false;
  const Json json = axlecast::saa_can::Decode(settings, packet, &usable);
  if (usable) {
    CheckObject(json);
  } else {
    Require(!json.at("error").get<std::string>().empty());
  }
  return 0;
}
