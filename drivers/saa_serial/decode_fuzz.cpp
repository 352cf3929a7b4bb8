// Any settings and any frame, also with the right checksum.
#include "drivers/saa_serial/family.h"

#include "drivers/saa_serial/codec.h"
#include "tests/fuzz/decode_fuzzing.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  FuzzedDataProvider input(data, size);
  const auto settings =
      axlecast::DrawSettings(input, 3, {"bits", "address", "other"},
                             [](FuzzedDataProvider& from) { return axlecast::NumberOrText(from, 8); });
  const bool mend_sum = input.ConsumeBool();
  auto frame = input.ConsumeRemainingBytes<std::uint8_t>();
  if (mend_sum && frame.size() > 1) {
    frame.back() = axlecast::saa_serial::Checksum(axlecast::Bytes(frame).first(frame.size() - 1));
  }
  axlecast::CheckDecode(axlecast::saa_serial::Decode, settings, frame,
                        [](const nlohmann::ordered_json& json, bool /*ok*/) {
                          if (json.contains("counts")) axlecast::Require(json["counts"] < 1U << 26U);
                        });
  return 0;
}
