#include "tools/fleet/read/position_query.h"

#include <gmock/gmock.h>

#include <axlecast/position_t.hpp>
#include <nlohmann/json.hpp>

#include "tools/fleet/position_chunk.h"

namespace axlecast {
namespace {

using nlohmann::json;

constexpr std::int64_t kUtime = 1'795'244'405'000'000;

const StreamKey kKey = {.device = "axis1",
                        .boot_id = 0x123456789ABCDEF0,
                        .datum_epoch = 2,
                        .counts_per_turn = 1 << 17,
                        .unit = position_t::UNIT_MM,
                        .unit_per_count = 0.25};

PositionSample SampleOf(int i) {
  PositionSample sample;
  sample.utime = kUtime + i * 4'000;
  sample.seq = 100 + i;
  sample.counts = 1'000 - i;
  sample.flags = 3;  // valid, turns_valid
  sample.received = sample.utime + 300;
  sample.time_uncertainty_ns = 1'500;
  sample.raw_counts = 7;
  sample.mono_ns = sample.utime * 1'000 + 42;
  sample.speed_rad_s = 0.5;
  return sample;
}

PositionChunkRow ChunkOfSamples(int n, Detail detail, const std::function<void(PositionSample&)>& change = {}) {
  ChannelDetail channel;
  channel.detail = detail;
  ChunkBuilder builder(kKey, 0, channel, ChunkBuilder::Source::kPosition);
  std::vector<PositionChunkRow> chunks;
  for (int i = 0; i < n; ++i) {
    PositionSample sample = SampleOf(i);
    if (change) change(sample);
    builder.Add(sample, chunks);
  }
  builder.End(chunks);
  EXPECT_EQ(chunks.size(), 1U);
  return chunks.front();
}

json Written(const PositionChunkRow& chunk, const QueryTimes& times = {}, bool full = false,
             std::int64_t limit = INT64_MAX) {
  std::string text;
  TableWriter table(TableFormat::kJson, PositionColumns(full), [&](std::string_view piece) {
    text += piece;
    return true;
  });
  EXPECT_TRUE(WriteChunk(chunk, kKey, times, full, limit, table));
  EXPECT_TRUE(table.End());
  return json::parse(text);
}

TEST(PositionQuery, WritesEachSampleOfAChunk) {
  const json rows = Written(ChunkOfSamples(3, Detail::kSamples));
  ASSERT_EQ(rows.size(), 3U);
  EXPECT_EQ(rows[1], json({{"utime", kUtime + 4'000},
                           {"utc", "2026-11-21T07:00:05.004000Z"},
                           {"device", "axis1"},
                           {"seq", 101},
                           {"counts", 999},
                           {"value", 249.75},
                           {"unit", "mm"},
                           {"flags", 3},
                           {"flag_names", "valid turns_valid"},
                           {"missed", 0},
                           {"boot_id", "123456789abcdef0"},
                           {"datum_epoch", 2}}));
}

TEST(PositionQuery, GivesNoValueOfAnInvalidSample) {
  const json rows = Written(ChunkOfSamples(2, Detail::kSamples, [](PositionSample& sample) { sample.flags = 0; }));
  EXPECT_TRUE(rows[0]["value"].is_null());
  EXPECT_EQ(rows[0]["counts"], 1'000);
  EXPECT_EQ(rows[0]["flag_names"], "");
}

TEST(PositionQuery, LeavesOutSamplesOutsideTheTimes) {
  const PositionChunkRow chunk = ChunkOfSamples(10, Detail::kSamples);
  const json rows = Written(chunk, {.from = kUtime + 4'000, .until = kUtime + 12'000});
  ASSERT_EQ(rows.size(), 2U) << "the begin belongs to it, the end does not";
  EXPECT_EQ(rows[0]["utime"], kUtime + 4'000);
  EXPECT_EQ(Written(chunk, {.from = kUtime + 40'000, .until = std::nullopt}).size(), 0U);
}

TEST(PositionQuery, StopsAtTheLimit) {
  EXPECT_EQ(Written(ChunkOfSamples(10, Detail::kSamples), {}, false, 4).size(), 4U);
}

TEST(PositionQuery, WritesTheFieldsOfDetailFullWhereTheyAreStored) {
  const json full = Written(ChunkOfSamples(2, Detail::kFull), {}, true);
  EXPECT_EQ(full[1]["mono_ns"], (kUtime + 4'000) * 1'000 + 42);
  EXPECT_EQ(full[1]["time_uncertainty_ns"], 1'500);
  EXPECT_EQ(full[1]["raw_counts"], 7);
  EXPECT_EQ(full[1]["received_utime"], kUtime + 4'300);
  const json samples = Written(ChunkOfSamples(2, Detail::kSamples), {}, true);
  for (const char* name : {"mono_ns", "time_uncertainty_ns", "raw_counts", "angle_rad", "published_value",
                           "speed_rad_s", "device_status", "tick", "received_utime"}) {
    EXPECT_TRUE(samples[1][name].is_null()) << name;
  }
}

TEST(PositionQuery, GivesASpeedOnlyIfItIsValid) {
  const auto with_speed = [](PositionSample& sample) { sample.flags |= position_t::FLAG_SPEED_VALID; };
  EXPECT_EQ(Written(ChunkOfSamples(1, Detail::kFull, with_speed), {}, true)[0]["speed_rad_s"], 0.5);
  EXPECT_TRUE(Written(ChunkOfSamples(1, Detail::kFull), {}, true)[0]["speed_rad_s"].is_null());
}

TEST(PositionQuery, ReportsADamagedChunk) {
  PositionChunkRow chunk = ChunkOfSamples(10, Detail::kSamples);
  chunk.body.resize(chunk.body.size() / 2);
  TableWriter table(TableFormat::kCsv, PositionColumns(true), [](std::string_view) { return true; });
  EXPECT_FALSE(WriteChunk(chunk, kKey, {}, true, INT64_MAX, table));
  EXPECT_EQ(table.rows(), 0);
}

}  // namespace
}  // namespace axlecast
