#include "tools/fleet/position_rows.h"

#include <cmath>
#include <limits>
#include <utility>

#include "core/base/time.h"
#include "core/device/reading.h"

namespace axlecast {
namespace {

constexpr double kUnknownValue = std::numeric_limits<double>::quiet_NaN();

std::optional<double> Finite(double value) { return std::isfinite(value) ? std::optional(value) : std::nullopt; }

}  // namespace

bool SeqWindow::IsNew(std::int64_t boot_id, std::int64_t seq) {
  constexpr std::uint64_t kBits = 64;
  if (boot_id_ != boot_id) {
    boot_id_ = boot_id;
    newest_ = seq;
    seen_ = 1;
    return true;
  }
  if (seq > newest_) {
    const std::uint64_t ahead = static_cast<std::uint64_t>(seq) - static_cast<std::uint64_t>(newest_);
    seen_ = ahead < kBits ? seen_ << ahead | 1U : 1U;
    newest_ = seq;
    return true;
  }
  const std::uint64_t behind = static_cast<std::uint64_t>(newest_) - static_cast<std::uint64_t>(seq);
  if (behind >= kBits) return true;
  const std::uint64_t bit = std::uint64_t{1} << behind;
  const bool is_new = (seen_ & bit) == 0;
  seen_ |= bit;
  return is_new;
}

std::int64_t BlockSampleUtime(const position_block_t& block, std::size_t i) {
  const std::int64_t ns = block.dt_ns[i];
  return block.utime + (ns - FloorMod(ns, kMicrosecond)) / kMicrosecond;
}

PositionRows::PositionRows(std::string device, std::optional<AxisScale> scale, const ChannelDetail& detail)
    : device_(std::move(device)), scale_(scale), detail_(detail) {}

PositionRows::Fields PositionRows::FieldsOf(const position_t& message) const {
  Fields fields{.boot_id = message.boot_id,
                .datum_epoch = message.datum_epoch,
                .counts_per_turn = message.counts_per_turn,
                .unit = message.unit,
                .unit_per_count = {}};
  if (scale_ && scale_->counts_per_turn == message.counts_per_turn && scale_->unit == message.unit) {
    fields.unit_per_count = Finite(scale_->unit_per_count);
  }
  return fields;
}

PositionRows::Fields PositionRows::FieldsOf(const position_block_t& message) {
  return {.boot_id = message.boot_id,
          .datum_epoch = message.datum_epoch,
          .counts_per_turn = message.counts_per_turn,
          .unit = message.unit,
          .unit_per_count = Finite(message.unit_per_count)};
}

StreamKey PositionRows::KeyOf(const Fields& fields) const {
  return {.device = device_,
          .boot_id = fields.boot_id,
          .datum_epoch = fields.datum_epoch,
          .counts_per_turn = fields.counts_per_turn,
          .unit = fields.unit,
          .unit_per_count = fields.unit_per_count};
}

void PositionRows::GoToStream(const Fields& fields, ChunkBuilder::Source source, BatchRows& batch) {
  if (fields_ == fields) return;
  EndChunk(batch);
  fields_ = fields;
  key_ = KeyOf(fields);
  if (detail_.detail > Detail::kRollup) chunk_.emplace(key_, batch.IndexOf(key_), detail_, source);
}

void PositionRows::AddSample(const PositionSample& sample, BatchRows& batch) {
  if (chunk_) chunk_->Add(sample, batch.chunks);
  roll_ups_.Add(key_, sample, batch);
}

void PositionRows::EndChunk(BatchRows& batch) {
  if (chunk_) {
    chunk_->End(batch.chunks);
    stored_ += chunk_->stored_events();
    chunk_.reset();
  }
  fields_.reset();
}

void PositionRows::Add(const position_t& message, std::int64_t event, std::int64_t received, BatchRows& batch) {
  ++events_;
  GoToStream(FieldsOf(message), ChunkBuilder::Source::kPosition, batch);
  AddSample({.utime = message.utime,
             .seq = message.seq,
             .counts = message.counts,
             .flags = message.flags,
             .missed = message.missed,
             .event = event,
             .mono_ns = message.mono_ns,
             .time_uncertainty_ns = message.time_uncertainty_ns,
             .raw_counts = message.raw_counts,
             .raw_turns = message.raw_turns,
             .angle_rad = message.angle_rad,
             .value = message.value,
             .speed_rad_s = message.speed_rad_s,
             .device_status = message.device_status,
             .tick = message.tick,
             .machine_id = message.machine_id,
             .clock_id = message.clock_id,
             .received = received},
            batch);
}

void PositionRows::Add(const position_block_t& message, std::int64_t event, std::int64_t received,
                       BatchRows& batch) {
  ++events_;
  GoToStream(FieldsOf(message), ChunkBuilder::Source::kBlock, batch);
  for (std::size_t i = 0; i < message.counts.size(); ++i) {
    PositionSample sample{.utime = BlockSampleUtime(message, i),
                          .seq = message.seq,
                          .counts = message.counts[i],
                          .flags = message.flags[i],
                          .missed = i == 0 ? message.missed : 0,
                          .event = event,
                          .time_uncertainty_ns = message.time_uncertainty_ns[i],
                          .angle_rad = kUnknownValue,
                          .value = kUnknownValue,
                          .speed_rad_s = kUnknownValue,
                          .machine_id = message.machine_id,
                          .clock_id = message.clock_id,
                          .received = received};
    sample.mono_ns = static_cast<std::int64_t>(static_cast<std::uint64_t>(message.mono_ns) +
                                               static_cast<std::uint64_t>(std::int64_t{message.dt_ns[i]}));
    AddSample(sample, batch);
  }
}

void PositionRows::End(BatchRows& batch) {
  EndChunk(batch);
  roll_ups_.End(batch);
  batch.counts.stored += stored_;
  batch.counts.rolled_up += events_ - stored_;
  events_ = stored_ = 0;
}

}  // namespace axlecast
