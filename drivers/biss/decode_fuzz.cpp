// Any settings and any frame.
#include "drivers/biss/family.h"

#include "tests/fuzz/decode_fuzzing.h"

namespace {

using axlecast::Require;

void CheckObject(const nlohmann::ordered_json& json, bool ok) {
  Require(json.at("kind") == "position_frame" || json.at("kind") == "transfer");
  Require(json.contains("counts") == ok && json.contains("angle_deg") == ok && json.contains("alarms") == ok);
}

std::string AnyValue(FuzzedDataProvider& input) {
  const std::string words[] = {"true",
                               "false",
                               "position",
                               "transfer",
                               input.ConsumeRandomLengthString(8),
                               std::to_string(input.ConsumeIntegral<std::uint8_t>())};
  return input.PickValueInArray(words);
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  FuzzedDataProvider input(data, size);
  const auto settings = axlecast::DrawSettings(
      input, 8,
      {"bits", "turn_bits", "crc_bits", "crc_poly", "crc_start", "crc_inverted", "frame", "bit_count", "other"},
      AnyValue);
  const auto frame = input.ConsumeRemainingBytes<std::uint8_t>();
  axlecast::CheckDecode(axlecast::biss::Decode, settings, frame, CheckObject);
  return 0;
}
