// Any settings and any frame: the decoder must answer with an object of README.md that can be printed, and never show
// what may be a password.
#include <fuzzer/FuzzedDataProvider.h>

#include <cstdlib>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "drivers/runtime/device/outcome_text.h"
#include "drivers/runtime/modbus/adu.h"
#include "drivers/tsubaki_sc/decode.h"

namespace {

using Json = nlohmann::ordered_json;
using FrameBytes = std::vector<std::uint8_t>;

void Require(bool holds) {
  if (!holds) std::abort();
}

void Seal(FrameBytes& frame) {
  const std::uint16_t crc = axlecast::modbus::Crc16(frame);
  frame.push_back(static_cast<std::uint8_t>(crc));
  frame.push_back(static_cast<std::uint8_t>(crc >> 8U));
}

// A request about an address of the unit, or any bytes.
std::string Request(FuzzedDataProvider& input) {
  auto request = input.ConsumeBytes<std::uint8_t>(input.ConsumeIntegralInRange<std::size_t>(0, 40));
  if (input.ConsumeBool()) {
    request.resize(6);
    request[1] = input.ConsumeIntegralInRange<std::uint8_t>(1, 6);
  }
  Seal(request);
  return axlecast::HexText(request);
}

axlecast::DecodeSettings Settings(FuzzedDataProvider& input) {
  axlecast::DecodeSettings settings;
  while (settings.size() < 3 && input.ConsumeBool()) {
    const char* key = input.PickValueInArray({"start", "request", "endian", "other"});
    std::string value = input.ConsumeRandomLengthString(12);
    if (input.ConsumeBool()) value = std::to_string(input.ConsumeIntegral<std::uint16_t>());
    if (input.ConsumeBool()) value = Request(input);
    if (input.ConsumeBool()) value = "low";
    settings.emplace_back(key, value);
  }
  return settings;
}

void CheckObject(const Json& json, const FrameBytes& frame) {
  const bool ok = json.at("ok").get<bool>();
  Require(!json.at("kind").get<std::string>().empty());
  Require(json.contains("error") == !ok);
  Require(json.size() == 3 || ok);  // a bad frame shows no value
  if (ok) Require(json.at("address") <= 16 && axlecast::modbus::IsSealed(frame));
  if (json.contains("masked")) Require(!json.contains("registers") && json.size() <= 6);
  const bool to_login = frame.size() > 5 && (frame[1] == 0x06 || frame[1] == 0x10) && frame[2] == 0 &&
                        ((frame[3] >= 100 && frame[3] <= 107) || (frame[3] >= 200 && frame[3] <= 207));
  if (to_login) Require(!json.contains("registers"));
  (void)json.dump();
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  FuzzedDataProvider input(data, size);
  const axlecast::DecodeSettings settings = Settings(input);
  const bool seal = input.ConsumeBool();
  auto frame = input.ConsumeRemainingBytes<std::uint8_t>();
  if (seal) Seal(frame);
  bool usable = false;
  const Json json = axlecast::tsubaki_sc::Decode(settings, frame, &usable);
  if (usable) {
    CheckObject(json, frame);
  } else {
    Require(!json.at("error").get<std::string>().empty());
  }
  return 0;
}
