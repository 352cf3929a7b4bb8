// Any settings and any frame: the decoder must answer with an object of docs/decode.md that can be printed.
#include "drivers/saa_modbus/decode.h"

#include <fuzzer/FuzzedDataProvider.h>

#include <cstdlib>
#include <nlohmann/json.hpp>
#include <vector>

#include "drivers/runtime/modbus/adu.h"

namespace {

using Json = nlohmann::ordered_json;

void Require(bool holds) {
  if (!holds) std::abort();
}

void CheckObject(const Json& json, bool has_bits) {
  const bool ok = json.at("ok").get<bool>();
  Require(!json.at("kind").get<std::string>().empty());
  Require(json.contains("error") == !ok);
  if (!ok) Require(json.size() == 3);
  Require(json.contains("angle_deg") == (json.contains("counts") && has_bits));
  if (json.contains("angle_deg")) Require(json["angle_deg"] >= 0.0 && json["angle_deg"] < 360.0);
  if (json.contains("new_address")) Require(json["new_address"] >= 1 && json["new_address"] <= 247);
  (void)json.dump();
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  FuzzedDataProvider input(data, size);
  axlecast::DecodeSettings settings;
  while (settings.size() < 3 && input.ConsumeBool()) {
    const char* key = input.PickValueInArray({"bits", "other"});
    settings.emplace_back(key, input.ConsumeBool() ? std::to_string(input.ConsumeIntegral<std::uint8_t>())
                                                   : input.ConsumeRandomLengthString(4));
  }
  const bool seal = input.ConsumeBool();
  auto frame = input.ConsumeBytes<std::uint8_t>(200);
  if (seal) {
    const axlecast::Frame sealed = axlecast::modbus::Sealed(axlecast::Frame(frame));
    frame.assign(sealed.data(), sealed.data() + sealed.size());
  }
  bool usable = false;
  const Json json = axlecast::saa_modbus::Decode(settings, frame, &usable);
  if (usable) {
    CheckObject(json, !settings.empty());
  } else {
    Require(!json.at("error").get<std::string>().empty());
  }
  return 0;
}
