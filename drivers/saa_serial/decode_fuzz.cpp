// Any settings and any frame: the decoder must answer with an object of docs/decode.md that can be printed.
#include <fuzzer/FuzzedDataProvider.h>

#include <cstdlib>
#include <nlohmann/json.hpp>
#include <vector>

#include "drivers/saa_serial/codec.h"
#include "drivers/saa_serial/decode.h"

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
  if (json.contains("counts")) Require(json["counts"] < 1U << 26U);
  if (json.contains("angle_deg")) Require(json["angle_deg"] >= 0.0 && json["angle_deg"] < 360.0);
  (void)json.dump();
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  FuzzedDataProvider input(data, size);
  axlecast::DecodeSettings settings;
  while (settings.size() < 3 && input.ConsumeBool()) {
    const char* key = input.PickValueInArray({"bits", "address", "other"});
    settings.emplace_back(key, input.ConsumeBool() ? std::to_string(input.ConsumeIntegral<std::uint8_t>())
                                                   : input.ConsumeRandomLengthString(8));
  }
  const bool mend_sum = input.ConsumeBool();
  auto frame = input.ConsumeRemainingBytes<std::uint8_t>();
  if (mend_sum && frame.size() > 1) {
    frame.back() = axlecast::saa_serial::Checksum(axlecast::Bytes(frame).first(frame.size() - 1));
  }
  bool usable = false;
  const Json json = axlecast::saa_serial::Decode(settings, frame, &usable);
  if (usable) {
    CheckObject(json);
  } else {
    Require(!json.at("error").get<std::string>().empty());
  }
  return 0;
}
