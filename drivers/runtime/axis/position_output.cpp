#include "drivers/runtime/axis/position_output.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace axlecast {
namespace {

constexpr double kUnknown = std::numeric_limits<double>::quiet_NaN();

// Set and cleared again: true once.
bool TakeFlag(bool& flag) {
  const bool was = flag;
  flag = false;
  return was;
}

}  // namespace

PositionOutput::PositionOutput(const BusConfig& bus, const DeviceConfig& device, const Axis& axis, Context context)
    : axis_(axis),
      context_(context),
      channel_("POSITION/" + device.name),
      block_channel_("POSITION_BLOCK/" + device.name),
      pace_(device.publish_hz, bus.poll_hz),
      position_{} {
  position_.boot_id = context.boot_id;
  position_.counts_per_turn = device.settings->counts_per_turn;
  position_.unit = device.unit;
  if (device.block) {
    block_.emplace(device.settings->counts_per_turn, device.unit, axis.scale().unit_per_count());
  }
}

void PositionOutput::Miss() {
  ++position_.missed;
  gap_ = any_good_;
  if (block_) block_->Miss();
}

void PositionOutput::Take(const Sample& sample, const AxisReading& reading) {
  const MonoNs at = sample.at.Middle();
  if (sample.has_turns) position_.raw_turns = sample.turns;
  switch (reading.kind) {
    case AxisReading::Kind::kWithheld:
      return Miss();
    case AxisReading::Kind::kDoubtful:
      gap_ = any_good_;
      if (block_) AddToBlock(sample, reading, reading.flags | context_.flags);
      if (!pace_.Doubtful(at)) {
        ++position_.missed;
        return;
      }
      return SendPosition(sample, reading, reading.flags | context_.flags);
    case AxisReading::Kind::kGood:
      break;
  }
  any_good_ = true;
  const bool after_gap = TakeFlag(gap_);
  gap_to_send_ = gap_to_send_ || after_gap;
  const std::int32_t flags = reading.flags | context_.flags;
  if (block_) AddToBlock(sample, reading, flags | (after_gap ? position_t::FLAG_AFTER_GAP : 0));
  if (!pace_.Good(at, flags, axis_.reference().epoch())) return;
  SendPosition(sample, reading, flags | (TakeFlag(gap_to_send_) ? position_t::FLAG_AFTER_GAP : 0));
}

void PositionOutput::SendPosition(const Sample& sample, const AxisReading& reading, std::int32_t flags) {
  const bool valid = (flags & position_t::FLAG_VALID) != 0;
  position_.mono_ns = sample.at.Middle();
  position_.utime = context_.time->Utime(position_.mono_ns);
  position_.time_uncertainty_ns =
      static_cast<std::int32_t>(std::clamp<std::int64_t>(sample.at.HalfWidth(), 0, INT32_MAX));
  position_.raw_counts = sample.counts;
  position_.counts = reading.counts;
  position_.angle_rad = valid ? axis_.scale().AngleRad(reading.counts) : kUnknown;
  position_.value = valid ? axis_.scale().Value(reading.counts) : kUnknown;
  position_.speed_rad_s = valid ? axis_.SpeedRadS() : kUnknown;
  position_.device_status = sample.device_status;
  position_.datum_epoch = axis_.reference().epoch();
  position_.flags = flags;
  if (!std::isnan(position_.speed_rad_s)) position_.flags |= position_t::FLAG_SPEED_VALID;
  if (TakeFlag(clock_stepped_)) position_.flags |= position_t::FLAG_CLOCK_STEPPED;
  Publish(*context_.sink, channel_, position_);
  ++position_.seq;
  position_.missed = 0;
}

void PositionOutput::AddToBlock(const Sample& sample, const AxisReading& reading, std::int32_t flags) {
  const std::int32_t epoch = axis_.reference().epoch();
  if (block_->MustGoBefore(sample.at.Middle(), epoch)) SendBlock();
  if (TakeFlag(clock_stepped_in_block_)) flags |= position_t::FLAG_CLOCK_STEPPED;
  block_->Add(sample.at, reading.counts, flags, epoch);
  if (block_->Full()) SendBlock();
}

void PositionOutput::SendBlock() {
  position_block_t& message = block_->Take();
  message.boot_id = context_.boot_id;
  message.seq = block_seq_++;
  message.utime = context_.time->Utime(message.mono_ns);
  Publish(*context_.sink, block_channel_, message);
  block_->Clear();
}

void PositionOutput::Tick(MonoNs now) {
  if (block_ && block_->Waited(now)) SendBlock();
}

}  // namespace axlecast
