// Any settings and any frame.
#include "drivers/ssi/family.h"

#include "tests/fuzz/decode_fuzzing.h"

namespace {

using axlecast::Require;

void CheckObject(const nlohmann::ordered_json& json, bool ok) {
  Require(json.at("kind") == "position_word");
  Require(json.contains("counts") == ok && json.contains("angle_deg") == ok);
  if (!ok) Require(!json.contains("alarms"));
}

std::string AnyValue(FuzzedDataProvider& input) {
  switch (input.ConsumeIntegralInRange(0, 3)) {
    case 0:
      return input.ConsumeRandomLengthString(12);
    case 1:
      return input.PickValueInArray({"true", "false", "joint", "separate", "plain", "tree25", "none", "one_zero",
                                     "no_gap", "zero", "repeat", "unchecked", "no_encoder", "position"});
    case 2:
      return std::string(input.PickValueInArray({"even:", "odd:", "alarm:"})) +
             std::to_string(input.ConsumeIntegral<std::uint8_t>());
    default:
      return std::to_string(input.ConsumeIntegral<std::uint8_t>());
  }
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  FuzzedDataProvider input(data, size);
  const auto settings =
      axlecast::DrawSettings(input, 8,
                             {"bits", "turn_bits", "gray", "halves", "format", "first_bit", "word_bits", "repeat",
                              "words", "trailing", "all_ones", "status", "parity", "bit_count", "other"},
                             AnyValue);
  const auto frame = input.ConsumeRemainingBytes<std::uint8_t>();
  axlecast::CheckDecode(axlecast::ssi::Decode, settings, frame, CheckObject);
  return 0;
}
