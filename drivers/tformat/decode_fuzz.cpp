// Any settings and any frame, also with the right CRC.
#include "drivers/tformat/family.h"

#include "drivers/tformat/codec.h"
#include "tests/fuzz/decode_fuzzing.h"

namespace {

using axlecast::Require;

void CheckObject(const nlohmann::ordered_json& json, bool ok) {
  Require(json.contains("id") == ok);
  Require(json.contains("counts") == json.contains("angle_deg"));
  if (json.contains("address")) Require(json["address"] < 80);
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  FuzzedDataProvider input(data, size);
  const auto settings =
      axlecast::DrawSettings(input, 3, {"bits", "turn_bits", "enid", "model", "other"},
                             [](FuzzedDataProvider& from) { return axlecast::NumberOrText(from, 8); });
  const bool mend_crc = input.ConsumeBool();
  auto frame = input.ConsumeRemainingBytes<std::uint8_t>();
  if (mend_crc && frame.size() > 1) {
    frame.back() = axlecast::tformat::Crc(axlecast::Bytes(frame).first(frame.size() - 1));
  }
  axlecast::CheckDecode(axlecast::tformat::Decode, settings, frame, CheckObject);
  return 0;
}
