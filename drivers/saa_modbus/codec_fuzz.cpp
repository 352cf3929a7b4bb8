// Any request, any reply, any resolution: the codec must not crash, and what it accepts must be what the manual's
// frames contain, byte by byte.
#include "drivers/saa_modbus/codec.h"

#include <fuzzer/FuzzedDataProvider.h>

#include <algorithm>
#include <cstdlib>
#include <vector>

#include "drivers/protocol/modbus/adu.h"
#include "drivers/saa_modbus/codec_test_support.h"
#include "drivers/saa_modbus/operations.h"

namespace axlecast::saa_modbus {
namespace {

using ByteList = std::vector<std::uint8_t>;

void Require(bool holds) {
  if (!holds) std::abort();
}

bool Same(Bytes a, Bytes b) { return std::equal(a.begin(), a.end(), b.begin(), b.end()); }

void CheckReply(const Request& asked, Bytes reply, int bits) {
  const Reply checked = Check(asked, reply, bits);
  const std::size_t length = ReplyLength(reply);
  Require(length <= 9);
  Require(checked.error == ErrorKind::kShort || length > 0);
  if (!checked.ok()) return;
  Require(reply.size() == length && IsSealedEitherWay(reply));
  Require(BeginsReplyTo(asked, reply));
  Require(checked.counts >> static_cast<unsigned>(bits) == 0);
  std::uint32_t counts = 0;
  if (asked.function == kReadPosition) {
    for (const std::uint8_t byte : reply.subspan(3, reply.size() - 5)) counts = counts * 256 + byte;
  }
  Require(checked.counts == counts);
  Require(asked.function == kQueryAddress || modbus::IsSealed(reply));
}

// Decoding uses the event alone, and a position is never taken from a time-out.
void CheckEvent(Bytes request, Bytes reply, int bits, bool complete) {
  const Event event{.kind = complete ? Event::Kind::kReply : Event::Kind::kTimeout,
                    .sent = {1, 2},
                    .received = {3, 4},
                    .request = request,
                    .bytes = reply};
  const Answer answer = Interpret(event, bits);
  Require(answer.ok() == !answer.error);
  Require(!answer.ok() || complete);
  Require(!answer.unanswered || !answer.ok());
  const Interval at = event.ActedWithin(event.bytes.size(), 500);
  Require(at.first <= at.last);
}

void Seal(ByteList& bytes, bool msb_first) {
  const Frame sealed = modbus::Sealed(Frame(bytes));
  bytes.assign(sealed.data(), sealed.data() + sealed.size());
  if (msb_first) std::swap(bytes[bytes.size() - 1], bytes[bytes.size() - 2]);
}

}  // namespace
}  // namespace axlecast::saa_modbus

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace axlecast::saa_modbus;
  FuzzedDataProvider input(data, size);
  const int bits = input.ConsumeIntegralInRange(kMinBits, kMaxBits);
  const bool complete = input.ConsumeBool();
  const bool seal_request = input.ConsumeBool();
  const bool seal_reply = input.ConsumeBool();
  const bool msb_first = input.ConsumeBool();
  auto request = input.ConsumeBytes<std::uint8_t>(input.ConsumeIntegralInRange<std::size_t>(0, 10));
  auto reply = input.ConsumeBytes<std::uint8_t>(200);
  if (seal_request) Seal(request, false);
  if (seal_reply) Seal(reply, msb_first);
  const auto asked = ParseRequest(request);
  if (asked) {
    Require(Same(Encoded(*asked), request));
    CheckReply(*asked, reply, bits);
  }
  if (const auto read = ParseRequest(reply)) Require(Same(Encoded(*read), reply));
  CheckReply({.address = 1, .registers = 2}, reply, bits);
  CheckEvent(request, reply, bits, complete);
  return 0;
}
