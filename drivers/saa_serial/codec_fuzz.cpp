// Any bytes and any format: the codec must not crash, and what it accepts must be exactly what an encoder would have
// sent.
#include <fuzzer/FuzzedDataProvider.h>

#include <cstdlib>

#include "core/device/step.h"
#include "drivers/saa_serial/codec.h"

namespace axlecast::saa_serial {
namespace {

void Require(bool holds) {
  if (!holds) std::abort();
}

void CheckReply(Bytes bytes, const Format& format) {
  const Reply reply = ParseReply(bytes, format);
  if (reply.error != ReplyError::kNone) return;
  Require(bytes.size() == ReplySize(format.bits) && bytes[0] == kFrameStart && bytes[1] == reply.header);
  Require(reply.header == kFixedHeader ? format.header != ReplyHeader::kAddress || format.address == kFixedHeader
                                       : reply.header == format.address && format.header != ReplyHeader::kFixed);
  Require(reply.counts >> static_cast<unsigned>(format.bits) == 0);
  std::uint32_t counts = 0;
  std::uint8_t sum = 0;
  for (std::size_t i = 0; i + 1 < bytes.size(); ++i) {
    if (i >= 2) counts = counts << 8U | bytes[i];
    sum = static_cast<std::uint8_t>(sum + bytes[i]);
  }
  Require(sum == bytes.back() && counts == reply.counts);
}

void CheckReading(Bytes bytes, const Format& format, bool complete) {
  const Event event{.kind = complete ? Event::Kind::kReply : Event::Kind::kTimeout,
                    .sent = {kSecond, kSecond},
                    .received = {kSecond + kMillisecond, kSecond + kMillisecond},
                    .request = {},
                    .bytes = bytes};
  const PolledReading polled = ReadReply(event, format, kMicrosecond);
  Require(polled.stray <= bytes.size());
  Require(polled.reading.at.first <= polled.reading.at.last);
  if (polled.reading.error) return;
  const std::size_t length = LengthRule(format.bits)(bytes);
  Require(length == polled.stray + ReplySize(format.bits));
  CheckReply(bytes.subspan(polled.stray, ReplySize(format.bits)), format);
}

}  // namespace
}  // namespace axlecast::saa_serial

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace axlecast::saa_serial;
  FuzzedDataProvider input(data, size);
  const Format format{
      .bits = input.ConsumeIntegralInRange(kMinBits, kMaxBits),
      .header = input.PickValueInArray({ReplyHeader::kEither, ReplyHeader::kAddress, ReplyHeader::kFixed}),
      .address = input.ConsumeIntegral<std::uint8_t>()};
  const bool mend_sum = input.ConsumeBool();
  const bool complete = input.ConsumeBool();
  auto bytes = input.ConsumeRemainingBytes<std::uint8_t>();
  if (mend_sum && !bytes.empty()) bytes.back() = Checksum(axlecast::Bytes(bytes).first(bytes.size() - 1));
  CheckReply(bytes, format);
  CheckReading(bytes, format, complete);
  if (const auto command = ParseRequest(bytes)) {
    const axlecast::Frame made = Request(*command);
    Require(std::equal(bytes.begin(), bytes.end(), made.data(), made.data() + made.size()));
  }
  return 0;
}
