// Any samples and any format: the codec must not crash, and what it accepts must be exactly what an encoder would have
// sent.
#include <fuzzer/FuzzedDataProvider.h>

#include <cstdlib>
#include <string>
#include <vector>

#include "drivers/biss/bits_test_support.h"
#include "drivers/biss/codec.h"
#include "drivers/biss/settings.h"

namespace axlecast::biss {
namespace {

void Require(bool holds) {
  if (!holds) std::abort();
}

Format TakeFormat(FuzzedDataProvider& input) {
  Format format{.bits = input.ConsumeIntegralInRange(kMinBits, kMaxBits),
                .turn_bits = input.ConsumeIntegralInRange(0, kMaxPositionBits - kMaxBits)};
  format.crc.bits = input.ConsumeIntegralInRange(kMinCrcBits, kMaxCrcBits);
  const std::uint32_t highest = 1U << static_cast<unsigned>(format.crc.bits);
  format.crc.polynomial =
      Polynomial(input.ConsumeIntegralInRange<std::int64_t>(0, highest - 1) | 1, format.crc.bits);
  format.crc.start = input.ConsumeIntegralInRange<std::uint32_t>(0, highest - 1);
  format.crc.inverted = input.ConsumeBool();
  return format;
}

std::string Covered(const Reply& reply, const Format& format) {
  return TextOf(reply.turns, format.turn_bits) + TextOf(reply.counts, format.bits) + (reply.failed ? '0' : '1') +
         (reply.warned ? '0' : '1');
}

std::string Whole(const std::string& covered, const Format& format) {
  const CrcRule& rule = format.crc;
  return covered + NaiveCrc(covered, rule.polynomial, rule.bits, rule.start, rule.inverted);
}

void CheckReply(const Reply& reply, const std::string& samples, const Format& format, const Search& search) {
  if (reply.error != FrameError::kNone) return;
  Require(reply.ack >= 2 && reply.ack < reply.start && reply.ack <= search.latest_ack);
  Require(reply.start <= search.latest_start);
  Require(samples.substr(0, reply.ack) == std::string(reply.ack, '1'));
  Require(samples.substr(reply.ack, reply.start - reply.ack) == std::string(reply.start - reply.ack, '0'));
  Require(samples.substr(reply.start, 2) == "10");
  const std::string frame = Whole(Covered(reply, format), format);
  Require(samples.substr(reply.start + 2, frame.size()) == frame);
}

}  // namespace
}  // namespace axlecast::biss

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace axlecast::biss;
  FuzzedDataProvider input(data, size);
  const Format format = TakeFormat(input);
  Search search;
  if (input.ConsumeBool()) {
    search.latest_ack = input.ConsumeIntegralInRange<std::size_t>(2, 300);
    search.latest_start = search.latest_ack + input.ConsumeIntegralInRange<std::size_t>(1, 300);
  }
  std::string samples;
  if (input.ConsumeBool()) {
    // A frame as it should be, perhaps with a bit inverted.
    samples = std::string(input.ConsumeIntegralInRange<std::size_t>(0, 40), '1') +
              std::string(input.ConsumeIntegralInRange<std::size_t>(0, 40), '0') + "10" +
              Whole(TextOf(input.ConsumeIntegral<std::uint64_t>(), format.turn_bits + format.bits + 2), format);
    const auto flip = input.ConsumeIntegralInRange<std::size_t>(0, 2 * samples.size());
    if (flip < samples.size()) samples[flip] = samples[flip] == '0' ? '1' : '0';
  } else {
    for (const std::uint8_t byte : input.ConsumeRemainingBytes<std::uint8_t>()) samples += TextOf(byte, 8);
  }
  const std::vector<std::uint8_t> bytes = BytesOf(samples);
  const std::size_t end = input.ConsumeBool() ? samples.size() : samples.size() / 2;
  CheckReply(FrameReader(format).ReadTransfer(bytes, end, search), samples.substr(0, end), format, search);
  return 0;
}
