// Any request and any reply: nothing crashes, and what is accepted is a whole frame that answers the request.
#include <fuzzer/FuzzedDataProvider.h>

#include <cstdlib>
#include <vector>

#include "drivers/protocol/modbus/adu.h"

using axlecast::Bytes;
using axlecast::Frame;

namespace axlecast::modbus {
namespace {

void Require(bool holds) {
  if (!holds) std::abort();
}

void CheckReply(Bytes request, Bytes bytes) {
  const std::size_t length = ReplyLength(bytes);
  Require(length <= 256 && (length == 0 || length >= 5));
  const Reply reply = Check(request, bytes);
  if (!reply.ok()) {
    Require(reply.data.empty());
    Require(reply.exception == 0 || reply.error == ErrorKind::kException);
    return;
  }
  Require(IsSealed(bytes) && bytes.size() == length && bytes[0] == request[0] && bytes[1] == request[1]);
  for (std::size_t index = 0; index < reply.data.size() / 2; ++index) (void)reply.Register(index);
  for (std::size_t index = 0; index < reply.data.size() * 8; ++index) (void)reply.Bit(index);
}

}  // namespace
}  // namespace axlecast::modbus

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace axlecast::modbus;
  FuzzedDataProvider input(data, size);
  const bool mend = input.ConsumeBool();
  const auto raw_request = input.ConsumeBytes<std::uint8_t>(input.ConsumeIntegralInRange<std::size_t>(0, 8));
  const auto raw_reply = input.ConsumeBytes<std::uint8_t>(input.ConsumeIntegralInRange<std::size_t>(0, 262));
  Frame reply{Bytes(raw_reply)};
  if (mend) reply = Sealed(reply);
  CheckReply(raw_request, reply);
  if (raw_request.size() == 6) CheckReply(Sealed(Frame(Bytes(raw_request))), reply);
  return 0;
}
