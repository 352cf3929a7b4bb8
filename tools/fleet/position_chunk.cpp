#include "tools/fleet/position_chunk.h"

#include <algorithm>
#include <array>
#include <axlecast/position_t.hpp>
#include <bit>
#include <cmath>
#include <limits>
#include <span>

#include "core/base/text.h"
#include "core/device/reading.h"

namespace axlecast {
namespace {

using ColumnValues = std::array<std::int64_t, kMaxChunkSamples>;
using Samples = std::span<const PositionSample>;

bool IsValid(std::int32_t flags) { return (flags & position_t::FLAG_VALID) != 0; }

std::int64_t Difference(std::int64_t a, std::int64_t b) {
  return static_cast<std::int64_t>(static_cast<std::uint64_t>(a) - static_cast<std::uint64_t>(b));
}
std::int64_t Sum(std::int64_t a, std::int64_t b) {
  return static_cast<std::int64_t>(static_cast<std::uint64_t>(a) + static_cast<std::uint64_t>(b));
}

std::int64_t LimitedMissed(std::int64_t missed) { return std::clamp<std::int64_t>(missed, 0, INT32_MAX); }

// mono_ns - utime x 1000
std::int64_t MonoOffset(std::int64_t utime) {
  return static_cast<std::int64_t>(static_cast<std::uint64_t>(utime) * 1'000);
}

constexpr double kUnknown = std::numeric_limits<double>::quiet_NaN();

std::int64_t BitsOf(double value) { return std::bit_cast<std::int64_t>(value); }
double DoubleOf(std::int64_t bits) { return std::bit_cast<double>(bits); }

// The nearest float. Beyond the range of float: infinite.
float Narrowed(double value) {
  constexpr double kMax = std::numeric_limits<float>::max();
  if (std::abs(value) > kMax)
    return std::copysign(std::numeric_limits<float>::infinity(), static_cast<float>(value > 0 ? 1 : -1));
  return static_cast<float>(value);
}
std::int64_t FloatBitsOf(double value) { return std::bit_cast<std::int32_t>(Narrowed(value)); }
double WidenedBits(std::int64_t float_bits) {
  return static_cast<double>(std::bit_cast<float>(static_cast<std::int32_t>(float_bits)));
}

// What a driver computes from counts and flags: the columns hold only the difference to it.
double AngleOf(const PositionSample& sample, const StreamKey& key) {
  return IsValid(sample.flags) && key.counts_per_turn > 0 ? AngleRad(sample.counts, key.counts_per_turn) : kUnknown;
}
double ValueOf(const PositionSample& sample, const StreamKey& key) {
  return IsValid(sample.flags) && key.unit_per_count ? static_cast<double>(sample.counts) * *key.unit_per_count
                                                     : kUnknown;
}

// Collects the columns of a body.
class BodyWriter {
 public:
  explicit BodyWriter(Samples samples) : samples_(samples) {}

  // `of` returns the value of a sample.
  template <typename Of>
  void Add(ColumnId id, Of of) {
    std::transform(samples_.begin(), samples_.end(), values_.begin(), of);
    AppendColumn(columns_, id, Column());
    ++count_;
  }
  // The same, but leaves out a column of zeros.
  template <typename Of>
  void AddUnlessZero(ColumnId id, Of of) {
    std::transform(samples_.begin(), samples_.end(), values_.begin(), of);
    const auto column = Column();
    if (std::all_of(column.begin(), column.end(), [](std::int64_t value) { return value == 0; })) return;
    AppendColumn(columns_, id, column);
    ++count_;
  }
  [[nodiscard]] std::vector<std::uint8_t> Take() {
    std::vector<std::uint8_t> body;
    body.reserve(2 + columns_.size());
    BeginBody(body, count_);
    body.insert(body.end(), columns_.begin(), columns_.end());
    return body;
  }

 private:
  [[nodiscard]] std::span<const std::int64_t> Column() const { return std::span(values_).first(samples_.size()); }

  Samples samples_;
  ColumnValues values_;
  std::vector<std::uint8_t> columns_;
  std::size_t count_ = 0;
};

bool IsNumberedOn(Samples samples) {
  for (std::size_t i = 1; i < samples.size(); ++i) {
    if (Difference(samples[i].seq, samples[i - 1].seq) != 1) return false;
  }
  return true;
}

void AddTimes(BodyWriter& body, std::int64_t t0) {
  body.Add(ColumnId::kUncertainty, [](const PositionSample& s) { return s.time_uncertainty_ns; });
  body.Add(ColumnId::kMonoOffset,
           [](const PositionSample& s) { return Difference(s.mono_ns, MonoOffset(s.utime)); });
  body.Add(ColumnId::kReceived, [t0](const PositionSample& s) { return Difference(s.received, t0); });
  body.AddUnlessZero(ColumnId::kClockId, [](const PositionSample& s) { return s.clock_id; });
  body.AddUnlessZero(ColumnId::kMachineId, [](const PositionSample& s) { return s.machine_id; });
}

void AddReadings(BodyWriter& body, const StreamKey& key) {
  body.Add(ColumnId::kRawCounts, [](const PositionSample& s) { return s.raw_counts; });
  body.Add(ColumnId::kRawTurns, [](const PositionSample& s) { return s.raw_turns; });
  body.Add(ColumnId::kSpeed, [](const PositionSample& s) { return FloatBitsOf(s.speed_rad_s); });
  body.Add(ColumnId::kDeviceStatus, [](const PositionSample& s) { return s.device_status; });
  body.Add(ColumnId::kTick, [](const PositionSample& s) { return s.tick; });
  body.AddUnlessZero(ColumnId::kSpeedRest, [](const PositionSample& s) {
    return Difference(BitsOf(s.speed_rad_s), BitsOf(WidenedBits(FloatBitsOf(s.speed_rad_s))));
  });
  body.AddUnlessZero(ColumnId::kAngleRest, [&key](const PositionSample& s) {
    return Difference(BitsOf(s.angle_rad), BitsOf(AngleOf(s, key)));
  });
  body.AddUnlessZero(ColumnId::kValueRest, [&key](const PositionSample& s) {
    return Difference(BitsOf(s.value), BitsOf(ValueOf(s, key)));
  });
}

// The columns of a body, decoded.
class BodyReader {
 public:
  static Result<BodyReader> Read(Bytes body, std::size_t n) {
    const auto columns = SplitBody(body);
    if (!columns) return Failure(columns.error());
    BodyReader reader;
    for (const ColumnView& column : *columns) {
      if (column.id >= reader.columns_.size()) continue;
      auto values = DecodeColumn(column, n);
      if (!values) return Failure(values.error());
      reader.columns_.at(column.id) = std::move(*values);
    }
    return reader;
  }

  [[nodiscard]] bool Has(ColumnId id) const { return !Values(id).empty(); }
  // Returns 0 for a column that is not there.
  [[nodiscard]] std::int64_t At(ColumnId id, std::size_t i) const { return Has(id) ? Values(id)[i] : 0; }
  [[nodiscard]] std::int32_t At32(ColumnId id, std::size_t i) const { return static_cast<std::int32_t>(At(id, i)); }

 private:
  [[nodiscard]] const std::vector<std::int64_t>& Values(ColumnId id) const {
    return columns_.at(static_cast<std::size_t>(id));
  }

  std::array<std::vector<std::int64_t>, static_cast<std::size_t>(ColumnId::kMachineId) + 1> columns_;
};

}  // namespace

void SummaryBuilder::Add(const PositionSample& sample) {
  ++n_;
  missed_ = LimitedMissed(missed_ + sample.missed);
  flags_or_ |= sample.flags;
  flags_and_ &= sample.flags;
  if (!IsValid(sample.flags)) return;
  if (valid_++ == 0) base_ = lo_ = hi_ = sample.counts;
  lo_ = std::min(lo_, sample.counts);
  hi_ = std::max(hi_, sample.counts);
  std::int64_t distance = 0;
  const bool overflows = __builtin_sub_overflow(sample.counts, base_, &distance);
  sum_ +=
      overflows ? static_cast<double>(sample.counts) - static_cast<double>(base_) : static_cast<double>(distance);
}

SampleSummary SummaryBuilder::Summary() const {
  SampleSummary summary{
      .n = n_, .valid = valid_, .missed = missed_, .flags_or = flags_or_, .flags_and = flags_and_};
  if (valid_ == 0) return summary;
  summary.lo = lo_;
  summary.hi = hi_;
  summary.mean = static_cast<double>(base_) + sum_ / static_cast<double>(valid_);
  return summary;
}

ChunkBuilder::ChunkBuilder(const StreamKey& key, std::size_t stream, const ChannelDetail& detail, Source source)
    : key_(key),
      stream_(stream),
      full_(detail.detail == Detail::kFull),
      source_(source),
      longest_us_(detail.longest / kMicrosecond) {
  samples_.reserve(kMaxChunkSamples);
  if (detail.detail != Detail::kDeadband || !key.unit_per_count || *key.unit_per_count == 0) return;
  deadband_counts_ = std::abs(detail.deadband / *key.unit_per_count);
}

void ChunkBuilder::Add(const PositionSample& sample, std::vector<PositionChunkRow>& chunks) {
  if (!samples_.empty()) {
    const std::int64_t before = skipped_ ? skipped_->utime : samples_.back().utime;
    const std::int64_t step = Difference(sample.utime, before);
    if (step < 0 || step > kLongestPause) End(chunks);
  }
  if (IsWithinDeadband(sample)) {
    skipped_ = sample;
    skipped_missed_ = LimitedMissed(skipped_missed_ + sample.missed);
    return;
  }
  Store(sample);
  if (samples_.size() == kMaxChunkSamples) End(chunks);
}

bool ChunkBuilder::IsWithinDeadband(const PositionSample& sample) const {
  if (!deadband_counts_ || samples_.empty()) return false;
  // The last place of a chunk is kept for the last sample.
  if (samples_.size() + 1 == kMaxChunkSamples) return false;
  const PositionSample& stored = samples_.back();
  const double moved = std::abs(static_cast<double>(sample.counts) - static_cast<double>(stored.counts));
  return sample.flags == stored.flags && moved <= *deadband_counts_ && sample.utime - stored.utime < longest_us_;
}

void ChunkBuilder::Store(PositionSample sample) {
  if (skipped_missed_ != 0)
    sample.missed = static_cast<std::int32_t>(LimitedMissed(skipped_missed_ + sample.missed));
  skipped_.reset();
  skipped_missed_ = 0;
  if (last_event_ != sample.event) ++stored_events_;
  last_event_ = sample.event;
  samples_.push_back(sample);
}

void ChunkBuilder::End(std::vector<PositionChunkRow>& chunks) {
  if (skipped_) {
    PositionSample last = *skipped_;
    last.missed = 0;  // counted in skipped_missed_
    Store(last);
  }
  if (samples_.empty()) return;
  SummaryBuilder summary;
  for (const PositionSample& sample : samples_) summary.Add(sample);
  chunks.push_back({.t0 = samples_.front().utime,
                    .t1 = samples_.back().utime,
                    .seq0 = samples_.front().seq,
                    .first = samples_.front().counts,
                    .last = samples_.back().counts,
                    .summary = summary.Summary(),
                    .stream = stream_,
                    .body = Body()});
  samples_.clear();
}

std::vector<std::uint8_t> ChunkBuilder::Body() const {
  const std::int64_t t0 = samples_.front().utime;
  const std::int64_t seq0 = samples_.front().seq;
  BodyWriter body(samples_);
  body.Add(ColumnId::kTime, [t0](const PositionSample& s) { return Difference(s.utime, t0); });
  body.Add(ColumnId::kCounts, [](const PositionSample& s) { return s.counts; });
  body.Add(ColumnId::kFlags, [](const PositionSample& s) { return s.flags; });
  body.Add(ColumnId::kMissed, [](const PositionSample& s) { return s.missed; });
  if (!IsNumberedOn(samples_))
    body.Add(ColumnId::kSeq, [seq0](const PositionSample& s) { return Difference(s.seq, seq0); });
  if (full_) AddTimes(body, t0);
  if (full_ && source_ == Source::kPosition) AddReadings(body, key_);
  return body.Take();
}

Result<std::vector<PositionSample>> DecodePositionChunk(const PositionChunkRow& chunk, const StreamKey& key) {
  if (chunk.summary.n < 1 || chunk.summary.n > static_cast<std::int64_t>(kMaxChunkSamples)) {
    return Failure(
        Text("a chunk cannot have %lld samples: the row was damaged", static_cast<long long>(chunk.summary.n)));
  }
  const auto n = static_cast<std::size_t>(chunk.summary.n);
  const auto body = BodyReader::Read(chunk.body, n);
  if (!body) return Failure(body.error());
  std::vector<PositionSample> samples(n);
  for (std::size_t i = 0; i < n; ++i) {
    PositionSample& s = samples[i];
    s.utime = Sum(chunk.t0, body->At(ColumnId::kTime, i));
    s.seq = Sum(chunk.seq0, body->Has(ColumnId::kSeq) ? body->At(ColumnId::kSeq, i) : static_cast<std::int64_t>(i));
    s.counts = body->At(ColumnId::kCounts, i);
    s.flags = body->At32(ColumnId::kFlags, i);
    s.missed = body->At32(ColumnId::kMissed, i);
    if (body->Has(ColumnId::kMonoOffset)) s.mono_ns = Sum(body->At(ColumnId::kMonoOffset, i), MonoOffset(s.utime));
    s.time_uncertainty_ns = body->At32(ColumnId::kUncertainty, i);
    s.raw_counts = body->At(ColumnId::kRawCounts, i);
    s.raw_turns = body->At32(ColumnId::kRawTurns, i);
    s.angle_rad = DoubleOf(Sum(BitsOf(AngleOf(s, key)), body->At(ColumnId::kAngleRest, i)));
    s.value = DoubleOf(Sum(BitsOf(ValueOf(s, key)), body->At(ColumnId::kValueRest, i)));
    const double speed = body->Has(ColumnId::kSpeed) ? WidenedBits(body->At(ColumnId::kSpeed, i)) : kUnknown;
    s.speed_rad_s = DoubleOf(Sum(BitsOf(speed), body->At(ColumnId::kSpeedRest, i)));
    s.device_status = body->At32(ColumnId::kDeviceStatus, i);
    s.tick = body->At(ColumnId::kTick, i);
    s.machine_id = body->At(ColumnId::kMachineId, i);
    s.clock_id = body->At(ColumnId::kClockId, i);
    if (body->Has(ColumnId::kReceived)) s.received = Sum(chunk.t0, body->At(ColumnId::kReceived, i));
  }
  return samples;
}

}  // namespace axlecast
