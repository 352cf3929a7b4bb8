#include "drivers/runtime/axis/position_output.h"

#include <algorithm>
#include <axlecast/position_t.hpp>
#include <cmath>
#include <initializer_list>
#include <limits>

namespace axlecast {
namespace {

constexpr std::int32_t Flags(std::initializer_list<std::int32_t> flags) {
  std::int32_t all = 0;
  for (const std::int32_t flag : flags) all |= flag;
  return all;
}

std::int32_t Narrow(std::int64_t ns) {
  return static_cast<std::int32_t>(std::clamp<std::int64_t>(ns, INT32_MIN, INT32_MAX));
}

constexpr double kUnknown = std::numeric_limits<double>::quiet_NaN();

// Clears the flag. Returns whether it was set.
bool TakeFlag(bool& flag) {
  const bool was = flag;
  flag = false;
  return was;
}

}  // namespace

const std::int32_t PublishPace::kStateFlags =
    Flags({position_t::FLAG_VALID, position_t::FLAG_TURNS_VALID, position_t::FLAG_TURNS_WRAPPED,
           position_t::FLAG_REFERENCED, position_t::FLAG_LOW_ACCURACY, position_t::FLAG_DEVICE_ERROR,
           position_t::FLAG_DEVICE_WARNING, position_t::FLAG_DATUM_CHANGING});

PublishPace::PublishPace(double publish_hz, double poll_hz)
    : every_(poll_hz > 0 && publish_hz >= poll_hz),
      period_(publish_hz > 0 ? static_cast<MonoNs>(static_cast<double>(kSecond) / publish_hz) : kNever),
      due_(publish_hz > 0 ? 0 : kNever) {}

bool PublishPace::Due(MonoNs at) {
  if (every_) return true;
  if (at < due_) return false;
  due_ = at - due_ < period_ ? due_ + period_ : at + period_;
  return true;
}

bool PublishPace::Good(MonoNs at, std::int32_t flags, std::int32_t epoch) {
  const std::int32_t state = flags & kStateFlags;
  bool send = Due(at) || doubt_shown_ || !any_ || epoch != epoch_;
  if (!send && state != state_ && at - extra_at_ >= kExtraPeriod) {
    extra_at_ = at;
    send = true;
  }
  in_doubt_ = false;
  if (!send) return false;
  any_ = true;
  doubt_shown_ = false;
  state_ = state;
  epoch_ = epoch;
  return true;
}

bool PublishPace::Doubtful(MonoNs at) {
  const bool send = at - doubt_at_ >= (in_doubt_ ? kDoubtPeriod : kExtraPeriod);
  in_doubt_ = true;
  if (!send) return false;
  doubt_at_ = at;
  doubt_shown_ = true;
  return true;
}

Block::Block(std::int64_t counts_per_turn, std::int8_t unit, double unit_per_count) : message_{} {
  message_.counts_per_turn = counts_per_turn;
  message_.unit = unit;
  message_.unit_per_count = unit_per_count;
  message_.dt_ns.reserve(position_block_t::MAX_SAMPLES);
  message_.time_uncertainty_ns.reserve(position_block_t::MAX_SAMPLES);
  message_.counts.reserve(position_block_t::MAX_SAMPLES);
  message_.flags.reserve(position_block_t::MAX_SAMPLES);
}

bool Block::MustGoBefore(MonoNs at, std::int32_t epoch) const {
  if (empty()) return false;
  const MonoNs dt = at - message_.mono_ns;
  return Full() || epoch != message_.datum_epoch || dt <= message_.dt_ns.back() || dt > kLongest;
}

void Block::Add(Interval at, std::int64_t counts, std::int32_t flags, std::int32_t epoch) {
  if (empty()) {
    message_.mono_ns = at.Middle();
    message_.datum_epoch = epoch;
  }
  message_.dt_ns.push_back(Narrow(at.Middle() - message_.mono_ns));
  message_.time_uncertainty_ns.push_back(Narrow(at.HalfWidth()));
  message_.counts.push_back(counts);
  message_.flags.push_back(flags);
  ++message_.n;
}

bool Block::Waited(MonoNs now) const { return !empty() && now - message_.mono_ns >= kLongest; }

position_block_t& Block::Take() { return message_; }

void Block::Clear() {
  message_.n = 0;
  message_.missed = 0;
  message_.dt_ns.clear();
  message_.time_uncertainty_ns.clear();
  message_.counts.clear();
  message_.flags.clear();
}

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
