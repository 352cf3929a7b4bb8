// Any settings and any frame: the decoder must answer with an object of docs/decode.md that can be printed.
#include <fuzzer/FuzzedDataProvider.h>

#include <cstdlib>
#include <nlohmann/json.hpp>
#include <vector>

#include "drivers/tformat/codec.h"
#include "drivers/tformat/decode.h"

namespace {

using Json = nlohmann::ordered_json;

void Require(bool holds) {
  if (!holds) std::abort();
}

void CheckObject(const Json& json) {
  const bool ok = json.at("ok").get<bool>();
  Require(!json.at("kind").get<std::string>().empty());
  Require(json.contains("error") == !ok);
  Require(json.contains("id") == ok);
  if (!ok) Require(!json.contains("counts") && !json.contains("turns") && !json.contains("angle_deg"));
  Require(json.contains("counts") == json.contains("angle_deg"));
  if (json.contains("angle_deg")) Require(json["angle_deg"] >= 0.0 && json["angle_deg"] < 360.0);
  if (json.contains("address")) Require(json["address"] < 80);
  (void)json.dump();
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  FuzzedDataProvider input(data, size);
  axlecast::DecodeSettings settings;
  while (settings.size() < 3 && input.ConsumeBool()) {
    const char* key = input.PickValueInArray({"bits", "turn_bits", "enid", "model", "other"});
    settings.emplace_back(key, input.ConsumeBool() ? std::to_string(input.ConsumeIntegral<std::uint8_t>())
                                                   : input.ConsumeRandomLengthString(8));
  }
  const bool mend_crc = input.ConsumeBool();
  auto frame = input.ConsumeRemainingBytes<std::uint8_t>();
  if (mend_crc && frame.size() > 1) {
    frame.back() = axlecast::tformat::Crc(axlecast::Bytes(frame).first(frame.size() - 1));
  }
  bool usable = false;
  const Json json = axlecast::tformat::Decode(settings, frame, &usable);
  if (usable) {
    CheckObject(json);
  } else {
    Require(!json.at("error").get<std::string>().empty());
  }
  return 0;
}
