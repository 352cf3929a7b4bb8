// Any settings and any packet.
#include "drivers/saa_can/family.h"

#include <vector>

#include "tests/fuzz/decode_fuzzing.h"

namespace {

std::string AnyValue(FuzzedDataProvider& input) {
  const char* word = input.PickValueInArray({"", "big", "little", "position", "reply"});
  return *word != 0 ? word : std::to_string(input.ConsumeIntegral<std::uint8_t>());
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  FuzzedDataProvider input(data, size);
  auto settings = axlecast::DrawSettings(
      input, 4, {"bits", "node", "byte_order", "data", "turn_bits", "cob_id", "other"}, AnyValue);
  if (input.ConsumeBool()) settings.emplace_back("model", input.ConsumeBool() ? "cia406" : "saa");
  std::vector<std::uint8_t> packet;
  if (input.ConsumeBool()) {
    // Within the identifiers that mean something.
    const int id = input.ConsumeIntegralInRange(0, 0x7FF);
    packet = {0, 0, static_cast<std::uint8_t>(id >> 8), static_cast<std::uint8_t>(id)};
  }
  const auto rest = input.ConsumeRemainingBytes<std::uint8_t>();
  packet.insert(packet.end(), rest.begin(), rest.end());
  axlecast::CheckDecode(axlecast::saa_can::Decode, settings, packet,
                        [](const nlohmann::ordered_json& /*json*/, bool /*ok*/) {});
  return 0;
}
