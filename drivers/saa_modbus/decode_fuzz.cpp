// Any settings and any frame, also with the right CRC.
#include "drivers/saa_modbus/family.h"

#include "drivers/protocol/modbus/adu.h"
#include "tests/fuzz/decode_fuzzing.h"

namespace {

using axlecast::Require;

void CheckObject(const nlohmann::ordered_json& json, bool ok, bool has_bits) {
  if (!ok) Require(json.size() == 3);
  Require(json.contains("angle_deg") == (json.contains("counts") && has_bits));
  if (json.contains("new_address")) Require(json["new_address"] >= 1 && json["new_address"] <= 247);
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  FuzzedDataProvider input(data, size);
  const auto settings = axlecast::DrawSettings(
      input, 3, {"bits", "other"}, [](FuzzedDataProvider& from) { return axlecast::NumberOrText(from, 4); });
  const bool seal = input.ConsumeBool();
  auto frame = input.ConsumeBytes<std::uint8_t>(200);
  if (seal) {
    const axlecast::Frame sealed = axlecast::modbus::Sealed(axlecast::Frame(frame));
    frame.assign(sealed.data(), sealed.data() + sealed.size());
  }
  axlecast::CheckDecode(
      axlecast::saa_modbus::Decode, settings, frame,
      [&](const nlohmann::ordered_json& json, bool ok) { CheckObject(json, ok, !settings.empty()); });
  return 0;
}
