#include "tools/fleet/position_chunk.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <axlecast/position_t.hpp>
#include <bit>
#include <cmath>
#include <limits>
#include <random>

namespace axlecast {
namespace {

using ::testing::ElementsAreArray;

constexpr double kNan = std::numeric_limits<double>::quiet_NaN();
constexpr std::int64_t kT = 1'790'000'000'000'000;

StreamKey Key() {
  return {.device = "axis1",
          .boot_id = 7,
          .datum_epoch = 0,
          .counts_per_turn = 131'072,
          .unit = position_t::UNIT_MM,
          .unit_per_count = 5.0 / 131'072};
}

PositionSample SampleAt(std::int64_t i, std::int64_t counts) {
  return {.utime = kT + i * 4'000,
          .seq = 100 + i,
          .counts = counts,
          .flags = position_t::FLAG_VALID,
          .missed = 0,
          .event = i};
}

struct Builder {
  explicit Builder(const ChannelDetail& detail, ChunkBuilder::Source source = ChunkBuilder::Source::kPosition)
      : chunks_of(Key(), 0, detail, source) {}
  void Add(const PositionSample& sample) { chunks_of.Add(sample, chunks); }
  std::vector<PositionChunkRow>& End() {
    chunks_of.End(chunks);
    return chunks;
  }

  ChunkBuilder chunks_of;
  std::vector<PositionChunkRow> chunks;
};

std::vector<PositionSample> Decoded(const PositionChunkRow& chunk) {
  const auto samples = DecodePositionChunk(chunk, Key());
  EXPECT_TRUE(samples) << ErrorText(samples);
  return samples.value_or(std::vector<PositionSample>());
}

// By hand from the description of a body: t 0, 4000, 8000; counts 5, 6, 8; flags 1; missed 0.
TEST(PositionChunk, Bytes) {
  Builder builder({.detail = Detail::kSamples});
  builder.Add(SampleAt(0, 5));
  builder.Add(SampleAt(1, 6));
  builder.Add(SampleAt(2, 8));
  const auto& chunks = builder.End();
  ASSERT_EQ(chunks.size(), 1U);
  const PositionChunkRow& chunk = chunks[0];
  EXPECT_THAT(
      chunk.body,
      ElementsAreArray(std::vector<std::uint8_t>{
          1, 4,                                                                  //
          1, 1, 2, 0, 0, 0, 12, 0, 0, 0, 0, 0, 0, 0, 0, 0x1F, 0x40, 0x1F, 0x40,  // 4000 in zigzag
          2, 1, 1, 0, 0, 0, 10, 0, 0, 0, 0, 0, 0, 0, 5, 2,    4,                 //
          3, 1, 0, 0, 0, 0, 8,  0, 0, 0, 0, 0, 0, 0, 1, 5,    1,    0,    0,    0, 0, 8, 0, 0, 0, 0, 0, 0, 0, 0}));
  EXPECT_EQ(chunk.t0, kT);
  EXPECT_EQ(chunk.t1, kT + 8'000);
  EXPECT_EQ(chunk.seq0, 100);
  EXPECT_EQ(chunk.first, 5);
  EXPECT_EQ(chunk.last, 8);
  EXPECT_EQ(
      chunk.summary,
      (SampleSummary{
          .lo = 5, .hi = 8, .mean = 19.0 / 3, .n = 3, .valid = 3, .missed = 0, .flags_or = 1, .flags_and = 1}));
}

TEST(PositionChunk, EndsAfter256SamplesAndWhereTimeJumpsOrRunsBack) {
  Builder builder({.detail = Detail::kSamples});
  for (std::int64_t i = 0; i < 300; ++i) builder.Add(SampleAt(i, i));
  PositionSample jump = SampleAt(300, 0);
  jump.utime = SampleAt(299, 0).utime + 10'000'001;
  builder.Add(jump);
  jump.utime += 10'000'000;
  builder.Add(jump);
  jump.utime -= 1;
  builder.Add(jump);
  const auto& chunks = builder.End();
  ASSERT_EQ(chunks.size(), 4U);
  EXPECT_EQ(chunks[0].summary.n, 256);
  EXPECT_EQ(chunks[1].summary.n, 44);
  EXPECT_EQ(chunks[2].summary.n, 2);
  EXPECT_EQ(chunks[3].summary.n, 1);
  EXPECT_EQ(builder.chunks_of.stored_events(), 301);  // three samples of one event
}

TEST(PositionChunk, SummaryIsOfValidSamplesOnly) {
  Builder builder({.detail = Detail::kSamples});
  PositionSample bad = SampleAt(0, -9'000);
  bad.flags = position_t::FLAG_IMPLAUSIBLE;
  bad.missed = 3;
  builder.Add(bad);
  auto chunks = builder.End();
  EXPECT_EQ(chunks[0].summary.lo, std::nullopt);
  EXPECT_EQ(chunks[0].summary.mean, std::nullopt);
  EXPECT_EQ(chunks[0].first, -9'000);
  builder.Add(bad);
  builder.Add(SampleAt(1, 10));
  chunks = builder.End();
  EXPECT_EQ(
      chunks[1].summary,
      (SampleSummary{
          .lo = 10, .hi = 10, .mean = 10, .n = 2, .valid = 1, .missed = 3, .flags_or = 0x101, .flags_and = 0}));
}

TEST(PositionChunk, MissedIsLimited) {
  SummaryBuilder summary;
  PositionSample sample = SampleAt(0, INT64_MAX);
  sample.missed = INT32_MAX;
  summary.Add(sample);
  sample.counts = INT64_MIN;
  summary.Add(sample);
  EXPECT_EQ(summary.Summary().missed, INT32_MAX);
  EXPECT_EQ(summary.Summary().lo, INT64_MIN);
  EXPECT_NEAR(summary.Summary().mean.value(), 0, 2'000);
}

PositionSample RandomSample(std::mt19937_64& random, std::int64_t i, bool wild) {
  PositionSample s = SampleAt(i, static_cast<std::int64_t>(random()) >> (random() % 64));
  s.seq = wild ? static_cast<std::int64_t>(random()) : s.seq;
  s.flags = static_cast<std::int32_t>(random() % 3);
  s.missed = wild ? static_cast<std::int32_t>(random()) : 0;
  s.mono_ns = static_cast<std::int64_t>(random());
  s.time_uncertainty_ns = static_cast<std::int32_t>(random());
  s.raw_counts = static_cast<std::int64_t>(random());
  s.raw_turns = static_cast<std::int32_t>(random());
  const auto number = [&] { return std::bit_cast<double>(random()); };
  s.angle_rad = wild ? number() : std::fmod(static_cast<double>(s.counts), 6.28);
  s.value = wild ? number() : static_cast<double>(s.counts) * 1e-3;
  s.speed_rad_s = wild ? number() : (random() % 2 == 0 ? kNan : static_cast<double>(random()) * 1e-12);
  s.device_status = static_cast<std::int32_t>(random());
  s.tick = static_cast<std::int64_t>(random());
  s.machine_id = 5;
  s.clock_id = static_cast<std::int64_t>(random() % 2);
  s.received = wild ? static_cast<std::int64_t>(random()) : s.utime + 300;
  return s;
}

// NaN with any payload and -0 too.
void ExpectSameBits(double a, double b) {
  EXPECT_EQ(std::bit_cast<std::uint64_t>(a), std::bit_cast<std::uint64_t>(b));
}

void ExpectSame(const PositionSample& a, const PositionSample& b) {
  EXPECT_EQ(std::tie(a.utime, a.seq, a.counts, a.flags, a.missed),
            std::tie(b.utime, b.seq, b.counts, b.flags, b.missed));
  EXPECT_EQ(std::tie(a.mono_ns, a.time_uncertainty_ns, a.raw_counts, a.raw_turns, a.device_status),
            std::tie(b.mono_ns, b.time_uncertainty_ns, b.raw_counts, b.raw_turns, b.device_status));
  EXPECT_EQ(std::tie(a.tick, a.machine_id, a.clock_id, a.received),
            std::tie(b.tick, b.machine_id, b.clock_id, b.received));
  ExpectSameBits(a.angle_rad, b.angle_rad);
  ExpectSameBits(a.value, b.value);
  ExpectSameBits(a.speed_rad_s, b.speed_rad_s);
}

TEST(PositionChunk, FullReturnsEveryFieldExactly) {
  std::mt19937_64 random(3);
  for (const bool wild : {false, true}) {
    Builder builder({.detail = Detail::kFull});
    std::vector<PositionSample> samples;
    for (std::int64_t i = 0; i < 200; ++i) samples.push_back(RandomSample(random, i, wild));
    for (const PositionSample& sample : samples) builder.Add(sample);
    const auto decoded = Decoded(builder.End().at(0));
    ASSERT_EQ(decoded.size(), samples.size());
    for (std::size_t i = 0; i < samples.size(); ++i) ExpectSame(decoded[i], samples[i]);
  }
}

TEST(PositionChunk, SamplesReturnWhatFollowsFromCounts) {
  Builder builder({.detail = Detail::kSamples});
  builder.Add(SampleAt(0, 131'072 / 4));
  PositionSample bad = SampleAt(1, 0);
  bad.flags = 0;
  builder.Add(bad);
  const auto decoded = Decoded(builder.End().at(0));
  EXPECT_DOUBLE_EQ(decoded.at(0).angle_rad, 1.5707963267948966);
  EXPECT_DOUBLE_EQ(decoded[0].value, 1.25);
  EXPECT_TRUE(std::isnan(decoded[0].speed_rad_s));
  EXPECT_TRUE(std::isnan(decoded[1].value));
  EXPECT_EQ(decoded[1].seq, 101);
}

TEST(PositionChunk, ALostMessageLeavesAGapInSeq) {
  Builder builder({.detail = Detail::kSamples});
  for (const std::int64_t i : {0, 1, 5, 6}) builder.Add(SampleAt(i, i));
  const auto decoded = Decoded(builder.End().at(0));
  ASSERT_EQ(decoded.size(), 4U);
  EXPECT_EQ(decoded[2].seq, 105);
  EXPECT_EQ(decoded[3].seq, 106);
}

// 0.01 mm are 262 counts.
TEST(Deadband, StoresWhatMovedAndBothEnds) {
  Builder builder({.detail = Detail::kDeadband, .deadband = 0.01});
  const std::vector<std::int64_t> counts{0, 100, -262, 263, 263, 300, 0, 1, 2, 3};
  for (std::size_t i = 0; i < counts.size(); ++i) {
    PositionSample sample = SampleAt(static_cast<std::int64_t>(i), counts[i]);
    sample.missed = 1;
    if (i == 4) sample.flags |= position_t::FLAG_AFTER_GAP;
    builder.Add(sample);
  }
  const auto& chunks = builder.End();
  ASSERT_EQ(chunks.size(), 1U);
  std::vector<std::int64_t> stored;
  std::int64_t missed = 0;
  for (const PositionSample& sample : Decoded(chunks[0])) {
    stored.push_back(sample.seq - 100);
    missed += sample.missed;
  }
  // 5: the flag is gone. 9: the last one.
  EXPECT_THAT(stored, ElementsAreArray({0, 3, 4, 5, 6, 9}));
  EXPECT_EQ(missed, 10);
  EXPECT_EQ(builder.chunks_of.stored_events(), 6);
}

TEST(Deadband, StoresOneSampleInTheLongestTime) {
  Builder builder({.detail = Detail::kDeadband, .deadband = 1, .longest = kSecond});
  for (std::int64_t i = 0; i < 1'000; ++i) builder.Add(SampleAt(i, 5));
  const auto& chunks = builder.End();
  ASSERT_EQ(chunks.size(), 1U);
  EXPECT_EQ(chunks[0].summary.n, 5);  // 0, 1, 2, 3 s and the last one
  EXPECT_EQ(chunks[0].t1, kT + 999 * 4'000);
}

TEST(PositionChunk, RefusesADamagedRow) {
  Builder builder({.detail = Detail::kSamples});
  for (std::int64_t i = 0; i < 20; ++i) builder.Add(SampleAt(i, i * i));
  PositionChunkRow chunk = builder.End().at(0);
  for (const std::int64_t n : {std::int64_t{0}, std::int64_t{19}, std::int64_t{257}, INT64_MAX, INT64_MIN}) {
    chunk.summary.n = n;
    EXPECT_FALSE(DecodePositionChunk(chunk, Key())) << n;
  }
  chunk.summary.n = 20;
  chunk.body.pop_back();
  EXPECT_FALSE(DecodePositionChunk(chunk, Key()));
}

}  // namespace
}  // namespace axlecast
