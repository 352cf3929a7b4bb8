// Any data and any format: the codec must not crash, and must decode correctly what it accepts.
#include <fuzzer/FuzzedDataProvider.h>

#include <algorithm>
#include <cstdlib>
#include <vector>

#include "drivers/saa_can/codec.h"

namespace axlecast::saa_can {
namespace {

void Require(bool holds) {
  if (!holds) std::abort();
}

void CheckPosition(Bytes data, const Format& format) {
  const Position position = ParsePosition(data, format);
  const std::size_t size = DataBytes(format.bits);
  Require((position.error == PositionError::kShort) == (data.size() < size));
  if (position.error != PositionError::kNone) return;
  Require(position.counts >> static_cast<unsigned>(format.bits) == 0);
  for (std::size_t i = 0; i < size; ++i) {
    const std::size_t place = format.big_endian ? size - 1 - i : i;
    Require(data[i] == static_cast<std::uint8_t>(position.counts >> 8 * place));
  }
  for (const Command command : kAcknowledged) {
    if (MayAcknowledge(data, command, format.bits) && !format.big_endian) {
      Require(position.counts == static_cast<std::uint8_t>(command));
    }
  }
}

void CheckRequest(Bytes data) {
  const auto request = ParseRequest(data);
  if (!request) return;
  const CanFrame made = CommandFrame(request->command, request->node, request->parameter);
  const Bytes bytes = made.data;
  Require(std::equal(data.begin(),
                     data.begin() + static_cast<std::ptrdiff_t>(std::min<std::size_t>(data.size(), 3)),
                     bytes.begin()));
}

}  // namespace
}  // namespace axlecast::saa_can

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace axlecast::saa_can;
  FuzzedDataProvider input(data, size);
  const Format format{.bits = input.ConsumeIntegralInRange(kMinBits, kMaxBits), .big_endian = input.ConsumeBool()};
  auto bytes = input.ConsumeRemainingBytes<std::uint8_t>();
  bytes.resize(std::min(bytes.size(), axlecast::kMaxCanData));
  CheckPosition(bytes, format);
  CheckRequest(bytes);
  (void)ParseServiceReply(bytes);
  return 0;
}
