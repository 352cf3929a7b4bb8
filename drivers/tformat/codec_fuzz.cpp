// Any request, any reply, any format: the codec must not crash, and what it accepts must be exactly what an encoder
// would have sent.
#include <fuzzer/FuzzedDataProvider.h>

#include <algorithm>
#include <cstdlib>

#include "drivers/tformat/codec.h"

using axlecast::Bytes;
using axlecast::Frame;

namespace axlecast::tformat {
namespace {

void Require(bool holds) {
  if (!holds) std::abort();
}

bool Same(Bytes a, Bytes b) { return std::equal(a.begin(), a.end(), b.begin(), b.end()); }

void CheckRequest(Bytes request) {
  const std::optional<RequestFields> fields = ParseRequest(request);
  if (!fields) return;
  Require(ParseControlField(request[0]) == fields->id);
  Require(request.size() == RequestSize(fields->id));
  Require(fields->address.has_value() == IsEeprom(fields->id) && fields->address.value_or(0) < kEepromCells);
  const Frame made = fields->data      ? EepromWriteRequest(*fields->address, *fields->data)
                     : fields->address ? EepromReadRequest(*fields->address)
                                       : Request(fields->id);
  Require(Same(made, request));
}

void CheckReply(Bytes request, Bytes bytes, const Format& format) {
  const Reply reply = ParseReply(request, bytes, format);
  const bool alarms_only =
      reply.error == ReplyError::kAbnormalReply || reply.error == ReplyError::kCommunicationAlarm;
  if (reply.error != ReplyError::kNone && !alarms_only) {
    Require(!reply.status && !reply.single_turn && !reply.multi_turn && !reply.encoder_id && !reply.alarms &&
            !reply.address && !reply.busy && !reply.data);
    return;
  }
  Require(Crc(bytes) == 0);
  Require(reply.single_turn.value_or(0) >> static_cast<unsigned>(format.single_turn_bits) == 0);
  Require(reply.multi_turn.value_or(0) >> static_cast<unsigned>(format.multi_turn_bits) == 0);
  Require((reply.alarms.value_or(0) & kAlmAlwaysZero) == 0);
  if (reply.error != ReplyError::kNone) return;
  Require(ParseRequest(request)->id == reply.id && bytes.size() == ReplySize(reply.id));
  Require((reply.status.value_or(0) & (kSfInformation | kSfParity | kSfDelimiter)) == 0);
  Require(reply.address.value_or(0) < kEepromCells);
  Require(reply.data.has_value() == (reply.busy == false));
  Require(Same(MakeReply(reply), bytes));
}

}  // namespace
}  // namespace axlecast::tformat

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace axlecast::tformat;
  FuzzedDataProvider input(data, size);
  const Format format{.single_turn_bits = input.ConsumeIntegralInRange(1, 24),
                      .multi_turn_bits = input.ConsumeIntegralInRange(0, 24)};
  const bool mend_crc = input.ConsumeBool();
  const auto request = input.ConsumeBytes<std::uint8_t>(input.ConsumeIntegralInRange<std::size_t>(0, 6));
  auto reply = input.ConsumeRemainingBytes<std::uint8_t>();
  if (mend_crc && !reply.empty()) reply.back() = Crc(Bytes(reply).first(reply.size() - 1));
  (void)ParseControlField(static_cast<std::uint8_t>(size));
  CheckRequest(request);
  CheckRequest(reply);
  CheckReply(request, reply, format);
  CheckReply(Bytes(reply).first(std::min<std::size_t>(reply.size(), 1)), reply, format);
  return 0;
}
