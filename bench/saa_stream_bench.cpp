// Bytes a second through the stream parser of saa_serial, beside a naive one that scans its buffer again for each frame
// and knows nothing of look-alikes, arrivals or errors.

#include <benchmark/benchmark.h>

#include <cstdint>
#include <vector>

#include "drivers/kit/simulation/simulated_fault.h"
#include "drivers/saa_serial/stream_parser.h"
#include "drivers/saa_serial/stream_test_support.h"

namespace axlecast::saa_serial {
namespace {

constexpr std::size_t kFrames = 4'096;

// A shaft that turns; `noise`: every 25th frame (1e-3) or every third (1e-2) has an inverted bit.
ByteList Stream(int bits, std::int64_t noise) {
  SeededRandom random(1);
  ByteList stream;
  for (std::uint32_t i = 0; i < kFrames; ++i) {
    ByteList frame = StreamFrame(i * 977 % (1U << static_cast<unsigned>(bits)), bits);
    if (noise > 0 && i % static_cast<std::uint32_t>(noise) == 0) {
      frame[random.Next() % frame.size()] ^= static_cast<std::uint8_t>(1U << random.Next() % 8);
    }
    Append(stream, frame);
  }
  return stream;
}

// Arguments: resolution, every how-manieth frame is damaged, bytes of one read.
void Arguments(benchmark::internal::Benchmark* bench) {
  bench->ArgNames({"bits", "damaged_every", "read"});
  for (const int bits : {16, 24}) {
    for (const int noise : {0, 25, 3}) {
      for (const int read : {7, 256}) bench->Args({bits, noise, read});
    }
  }
}

void Report(benchmark::State& state, const ByteList& stream) {
  state.SetBytesProcessed(static_cast<std::int64_t>(state.iterations()) * static_cast<std::int64_t>(stream.size()));
}

void Parser(benchmark::State& state) {
  const int bits = static_cast<int>(state.range(0));
  const ByteList stream = Stream(bits, state.range(1));
  const auto read = static_cast<std::size_t>(state.range(2));
  for (auto _ : state) {
    StreamParser parser(bits);
    MonoNs now = 0;
    for (std::size_t at = 0; at < stream.size(); at += read) {
      const std::size_t count = std::min(read, stream.size() - at);
      parser.Append(Bytes(stream).subspan(at, count), {now, now + 1});
      ++now;
      while (const auto found = parser.Next()) benchmark::DoNotOptimize(found->counts);
    }
  }
  Report(state, stream);
}
BENCHMARK(Parser)->Apply(Arguments);

// The usual way: append, look for FF 81 from the front, check, erase.
void NaiveRescan(benchmark::State& state) {
  const int bits = static_cast<int>(state.range(0));
  const ByteList stream = Stream(bits, state.range(1));
  const auto read = static_cast<std::size_t>(state.range(2));
  const std::size_t size = ReplySize(bits);
  for (auto _ : state) {
    ByteList buffer;
    for (std::size_t at = 0; at < stream.size(); at += read) {
      const std::size_t count = std::min(read, stream.size() - at);
      const Bytes part = Bytes(stream).subspan(at, count);
      buffer.insert(buffer.end(), part.begin(), part.end());
      for (bool found = true; found;) {
        found = false;
        for (std::size_t i = 0; i + size <= buffer.size(); ++i) {
          const Reply reply = ParseReply(Bytes(buffer).subspan(i, size), {.bits = bits});
          if (reply.error != ReplyError::kNone) continue;
          benchmark::DoNotOptimize(reply.counts);
          buffer.erase(buffer.begin(), buffer.begin() + static_cast<std::ptrdiff_t>(i + size));
          found = true;
          break;
        }
      }
    }
  }
  Report(state, stream);
}
BENCHMARK(NaiveRescan)->Apply(Arguments);

}  // namespace
}  // namespace axlecast::saa_serial

BENCHMARK_MAIN();
