// Any settings and any frame, also with the right CRC; what may be a password must never be shown.
#include "drivers/tsubaki_sc/family.h"

#include <string>
#include <vector>

#include "core/device/operation.h"
#include "drivers/protocol/modbus/adu.h"
#include "tests/fuzz/decode_fuzzing.h"

namespace {

using axlecast::Require;
using FrameBytes = std::vector<std::uint8_t>;

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

std::string AnyValue(FuzzedDataProvider& input) {
  std::string value = input.ConsumeRandomLengthString(12);
  if (input.ConsumeBool()) value = std::to_string(input.ConsumeIntegral<std::uint16_t>());
  if (input.ConsumeBool()) value = Request(input);
  if (input.ConsumeBool()) value = "low";
  return value;
}

void CheckObject(const nlohmann::ordered_json& json, bool ok, const FrameBytes& frame) {
  Require(json.size() == 3 || ok);  // a bad frame shows no value
  if (ok) Require(json.at("address") <= 16 && axlecast::modbus::IsSealed(frame));
  if (json.contains("masked")) Require(!json.contains("registers") && json.size() <= 6);
  const bool to_login = frame.size() > 5 && (frame[1] == 0x06 || frame[1] == 0x10) && frame[2] == 0 &&
                        ((frame[3] >= 100 && frame[3] <= 107) || (frame[3] >= 200 && frame[3] <= 207));
  if (to_login) Require(!json.contains("registers"));
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  FuzzedDataProvider input(data, size);
  const auto settings = axlecast::DrawSettings(input, 3, {"start", "request", "endian", "other"}, AnyValue);
  const bool seal = input.ConsumeBool();
  auto frame = input.ConsumeRemainingBytes<std::uint8_t>();
  if (seal) Seal(frame);
  axlecast::CheckDecode(axlecast::tsubaki_sc::Decode, settings, frame,
                        [&](const nlohmann::ordered_json& json, bool ok) { CheckObject(json, ok, frame); });
  return 0;
}
