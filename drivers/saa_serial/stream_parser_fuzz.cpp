// Any stream in any pieces: what the parser finds are frames, in order, each once; how the stream was cut into reads
// changes nothing; up to 16 bits no frame that another follows is lost to anything but frames that are followed too.
#include <fuzzer/FuzzedDataProvider.h>

#include <algorithm>
#include <cstdlib>
#include <vector>

#include "drivers/saa_serial/stream_parser.h"
#include "drivers/saa_serial/stream_test_support.h"

namespace axlecast::saa_serial {
namespace {

void Require(bool holds) {
  if (!holds) std::abort();
}

void CheckFound(const ByteList& stream, int bits, const std::vector<std::int64_t>& places) {
  const auto size = static_cast<std::int64_t>(ReplySize(bits));
  const std::set<std::int64_t> all = NaiveFrames(stream, bits);
  std::int64_t end = 0;
  for (const std::int64_t place : places) {
    Require(all.contains(place));
    Require(place >= end || (place == end - 1 && stream[static_cast<std::size_t>(place)] == kFrameStart));
    end = place + size;
  }
  const auto found = [&](std::int64_t place) { return std::binary_search(places.begin(), places.end(), place); };
  for (const std::int64_t place : all) {
    bool followed = all.contains(place + size);
    bool alone = true;
    for (std::int64_t at = place - size + 1; at < place + size; ++at) {
      if (at == place || !all.contains(at)) continue;
      alone = false;
      followed = followed && !all.contains(at + size) && !found(at);
    }
    Require(found(place) || !(alone || followed));
  }
}

}  // namespace
}  // namespace axlecast::saa_serial

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace axlecast::saa_serial;
  FuzzedDataProvider input(data, size);
  const int bits = input.ConsumeIntegralInRange(kMinBits, kMaxBits);
  const std::size_t chunk = input.ConsumeIntegralInRange<std::size_t>(1, 40);
  ByteList stream;
  while (input.remaining_bytes() > 0 && stream.size() < 2'000) {
    if (input.ConsumeBool()) {
      const auto counts = input.ConsumeIntegral<std::uint32_t>() % (1U << static_cast<unsigned>(bits));
      Append(stream, StreamFrame(counts, bits));
    } else {
      Append(stream, input.ConsumeBytes<std::uint8_t>(input.ConsumeIntegralInRange<std::size_t>(0, 8)));
    }
  }
  stream.resize(stream.size() + 3 * ReplySize(bits), 0);
  StreamParser parser(bits);
  const auto places = FramePlaces(ParseAll(parser, stream, chunk));
  CheckFound(stream, bits, places);
  StreamParser whole(bits);
  Require(FramePlaces(ParseAll(whole, stream, 400)) == places);
  Require(whole.skipped() == parser.skipped() && whole.ambiguous() == parser.ambiguous());
  return 0;
}
