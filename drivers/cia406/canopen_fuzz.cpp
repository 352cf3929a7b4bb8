#include <cstdint>
#include <cstdlib>
#include <nlohmann/json.hpp>

#include "drivers/cia406/cia406.h"
#include "drivers/protocol/canopen/canopen.h"

// The parsers and the decoder take any frame: two bytes of identifier, then its data.
extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace axlecast;
  using namespace axlecast::cia406;
  using namespace axlecast::canopen;
  if (size < 2 || size > 2 + kMaxCanData) return 0;
  CanFrame frame{.id = static_cast<std::uint32_t>(data[0] << 8 | data[1]) & 0x7FF, .data = {}};
  frame.data.Append(Bytes(data + 2, size - 2));
  const Bytes bytes = frame.data;
  const SdoAnswer answer = ParseAnswer(bytes);
  if (answer.kind == SdoAnswer::Kind::kValue && (answer.size < 1 || answer.size > 4)) std::abort();
  if (answer.kind == SdoAnswer::Kind::kValue && answer.size < 4 && answer.value >> (8 * answer.size) != 0)
    std::abort();
  if (const auto request = ParseRequest(bytes)) {
    // What was read as a request is the same when it is sent again.
    const auto again = ParseRequest(RequestFrame(1, *request).data);
    if (!again || again->object != request->object || again->write != request->write) std::abort();
  }
  static_cast<void>(ParseHeartbeat(bytes));
  if (const auto emergency = ParseEmergency(bytes)) {
    static_cast<void>(EmergencyClass(emergency->code));
    static_cast<void>(ErrorRegisterText(emergency->error_register));
  }
  const auto json = Decode({{"bits", "13"}, {"turn_bits", "12"}}, frame);
  if (!json || !json->contains("ok")) std::abort();
  return 0;
}
