#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <vector>

#include "core/base/result.h"
#include "tools/fleet/column.h"
#include "tools/fleet/detail.h"
#include "tools/fleet/rows.h"

namespace axlecast {

// One sample of a stream: what position_t holds beside the fields of StreamKey. `spare` is not kept.
struct PositionSample {
  std::int64_t utime = 0;
  std::int64_t seq = 0;  // of the message: all samples of a block have the same
  std::int64_t counts = 0;
  std::int32_t flags = 0;
  std::int32_t missed = 0;  // of a block: in its first sample
  std::int64_t event = 0;   // of the log; not in a chunk

  // Detail::kFull only. A decoded chunk of less detail has 0, except angle_rad and value, which follow from the counts.
  std::int64_t mono_ns = 0;
  std::int32_t time_uncertainty_ns = 0;
  std::int64_t raw_counts = 0;
  std::int32_t raw_turns = 0;
  double angle_rad = 0;
  double value = 0;
  double speed_rad_s = 0;  // NaN in a decoded chunk of less detail, and of a block
  std::int32_t device_status = 0;
  std::int64_t tick = 0;
  std::int64_t machine_id = 0;
  std::int64_t clock_id = 0;
  std::int64_t received = 0;  // us, UNIX time
};

// Joins samples to a SampleSummary.
class SummaryBuilder {
 public:
  void Add(const PositionSample& sample);
  [[nodiscard]] bool empty() const { return n_ == 0; }
  [[nodiscard]] SampleSummary Summary() const;

 private:
  std::int64_t n_ = 0;
  std::int64_t valid_ = 0;
  std::int64_t missed_ = 0;
  std::int32_t flags_or_ = 0;
  std::int32_t flags_and_ = -1;
  std::int64_t base_ = 0;  // counts of the first valid sample
  std::int64_t lo_ = 0;
  std::int64_t hi_ = 0;
  double sum_ = 0;  // of counts - base_
};

// Collects the samples of one stream and makes chunks of them. A chunk ends
// - after kMaxChunkSamples,
// - before a sample whose time is before that of its predecessor, or more than kLongestPause after it,
// - with End().
//
// The body has the columns t, counts, flags and missed, and seq unless the sample i has the number seq0 + i.
// With Detail::kFull it has the columns of every field of position_t as well, or of a block: those that position_block_t has.
class ChunkBuilder {
 public:
  static constexpr std::int64_t kLongestPause = 10'000'000;  // us

  enum class Source : std::uint8_t { kPosition, kBlock };

  // `key`: of the samples; `stream`: its index. `detail`: kDeadband or more.
  ChunkBuilder(const StreamKey& key, std::size_t stream, const ChannelDetail& detail, Source source);

  // Adds a sample, and a chunk that has ended to `chunks`.
  void Add(const PositionSample& sample, std::vector<PositionChunkRow>& chunks);
  // Ends the chunk, if there is one.
  void End(std::vector<PositionChunkRow>& chunks);

  // Returns the number of events with at least one sample in a chunk. Exact after End.
  [[nodiscard]] std::int64_t stored_events() const { return stored_events_; }

 private:
  [[nodiscard]] bool IsWithinDeadband(const PositionSample& sample) const;
  void Store(PositionSample sample);
  [[nodiscard]] std::vector<std::uint8_t> Body() const;

  StreamKey key_;
  std::size_t stream_;
  bool full_;
  Source source_;
  std::optional<double> deadband_counts_;  // nothing: every sample is stored
  std::int64_t longest_us_;
  std::vector<PositionSample> samples_;
  std::optional<PositionSample> skipped_;  // the newest sample, if it is within the deadband
  std::int64_t skipped_missed_ = 0;        // of the samples that were left out since the last stored one
  std::int64_t stored_events_ = 0;
  std::optional<std::int64_t> last_event_;
};

// Decodes the samples of a chunk. Fails on a damaged body.
[[nodiscard]] Result<std::vector<PositionSample>> DecodePositionChunk(const PositionChunkRow& chunk,
                                                                      const StreamKey& key);

}  // namespace axlecast
