#include "drivers/runtime/axis/device_publisher.h"

#include <axlecast/device_info_t.hpp>
#include <cmath>
#include <iterator>
#include <limits>
#include <utility>

#include "core/alarm/alarm_codes.h"
#include "core/base/text.h"
#include "core/config/ticks.h"

namespace axlecast {
namespace {

// Readings come at a steady rate. A reading that is up to 10 % early still counts as the next one.
constexpr double kEarly = 0.9;

std::int32_t FlagsOf(const MotorReading& reading) {
  return (reading.has_analog() ? motor_health_t::FLAG_ANALOG_VALID : 0) |
         (reading.has_status() ? motor_health_t::FLAG_STATUS_VALID : 0) |
         (reading.tripped ? motor_health_t::FLAG_TRIPPED : 0);
}

// Returns true if both values are equal or both are unknown (NaN).
bool Same(float a, float b) { return a == b || (std::isnan(a) && std::isnan(b)); }
template <std::size_t N>
bool Same(const float (&a)[N], const float (&b)[N]) {
  return std::equal(std::begin(a), std::end(a), std::begin(b), [](float x, float y) { return Same(x, y); });
}

bool SameLimits(const motor_limits_t& a, const motor_limits_t& b) {
  return Same(a.power_upper_w, b.power_upper_w) && Same(a.power_lower_w, b.power_lower_w) &&
         Same(a.start_time_s, b.start_time_s) && Same(a.shock_time_upper_s, b.shock_time_upper_s) &&
         Same(a.shock_time_lower_s, b.shock_time_lower_s) && Same(a.overheat_c, b.overheat_c) &&
         Same(a.shock_mps2, b.shock_mps2) && Same(a.log_interval_s, b.log_interval_s) &&
         Same(a.parameters, b.parameters);
}

}  // namespace

MotorOutput::MotorOutput(const std::string& device, double publish_hz, const DevicePublisherContext& context,
                         bool simulated)
    : context_(context),
      simulated_(simulated),
      period_(publish_hz > 0 ? static_cast<MonoNs>(kEarly * static_cast<double>(kSecond) / publish_hz) : 0),
      motor_channel_("MOTOR/" + device),
      trip_channel_("TRIP/" + device),
      limits_channel_("LIMITS/" + device) {
  context.origin.Set(motor_);
  context.origin.Set(trip_);
  context.origin.Set(limits_);
  trip_.device = CappedText(device, kNameBytes);
}

void MotorOutput::Take(const MotorReading& reading) {
  const MonoNs at = std::max(reading.analog_at.last, reading.status_at.last);
  if (motor_.seq > 0 && at - motor_at_ < period_) return;
  motor_at_ = at;
  motor_.mono_ns = reading.has_analog() ? reading.analog_at.Middle() : at;
  motor_.utime = UnixUs(motor_.mono_ns);
  motor_.analog_mono_ns = reading.analog_at.Middle();
  motor_.status_mono_ns = reading.status_at.Middle();
  motor_.voltage_v = reading.voltage_v;
  motor_.current_a = reading.current_a;
  motor_.power_w = reading.power_w;
  motor_.temperature_c = reading.temperature_c;
  std::copy(reading.accel_mps2.begin(), reading.accel_mps2.end(), motor_.accel_mps2);
  motor_.trip_count = reading.trip_count;
  motor_.status_bits = reading.status_bits;
  std::copy(reading.trip_factor.begin(), reading.trip_factor.end(), motor_.trip_factor);
  motor_.stop_coil = reading.stop_coil;
  motor_.logged_in = reading.logged_in;
  motor_.mains_hz = reading.mains_hz;
  motor_.flags = FlagsOf(reading) | (simulated_ ? motor_health_t::FLAG_SIMULATED : 0) |
                 (context_.redecoded ? motor_health_t::FLAG_REDECODED : 0);
  if (Publish(*context_.sink, motor_channel_, motor_)) ++motor_.seq;
}

void MotorOutput::Take(const TripRecord& record) {
  trip_log_t message = trip_;
  message.log_index = record.log_index;
  message.trip_count = record.trip_count;
  message.factor_bits = record.factor_bits;
  message.not_before_utime = UnixUs(record.not_before);
  message.not_after_utime = UnixUs(record.not_after);
  message.interval_us = record.interval_us;
  message.valid_mask = static_cast<std::int8_t>(record.valid_mask);
  message.mono_ns = record.at.last;
  message.utime = UnixUs(record.at.last);
  for (std::size_t q = 0; q < TripRecord::kQuantities; ++q) {
    std::copy(record.samples[q].begin(), record.samples[q].end(), message.samples[q]);
  }
  message.seq = trip_seq_;
  if (Publish(*context_.sink, trip_channel_, message)) ++trip_seq_;
  if (record.log_index != 1) return;
  trip_ = message;
  trip_at_ = record.at.last;
}

void MotorOutput::Take(const MotorLimits& limits, MonoNs now) {
  motor_limits_t message = limits_;
  std::copy(limits.power_upper_w.begin(), limits.power_upper_w.end(), message.power_upper_w);
  std::copy(limits.power_lower_w.begin(), limits.power_lower_w.end(), message.power_lower_w);
  message.start_time_s = limits.start_time_s;
  std::copy(limits.shock_time_upper_s.begin(), limits.shock_time_upper_s.end(), message.shock_time_upper_s);
  std::copy(limits.shock_time_lower_s.begin(), limits.shock_time_lower_s.end(), message.shock_time_lower_s);
  message.overheat_c = limits.overheat_c;
  message.shock_mps2 = limits.shock_mps2;
  message.log_interval_s = limits.log_interval_s;
  std::copy(limits.parameters.begin(), limits.parameters.end(), message.parameters);
  message.flags =
      (simulated_ ? motor_limits_t::FLAG_SIMULATED : 0) | (context_.redecoded ? motor_limits_t::FLAG_REDECODED : 0);
  const bool changed = limits_at_ == kNever || !SameLimits(message, limits_);
  message.mono_ns = limits.at.Middle();
  message.utime = UnixUs(message.mono_ns);
  limits_ = message;
  if (changed) SendLimits(now);
}

void MotorOutput::SendLimits(MonoNs now) {
  limits_at_ = now;
  if (Publish(*context_.sink, limits_channel_, limits_)) ++limits_.seq;
}

void MotorOutput::Tick(MonoNs now) {
  if (limits_at_ != kNever && now - limits_at_ >= kRepeat) SendLimits(now);
  if (trip_at_ == kNever || now - trip_at_ < kRepeat) return;
  trip_at_ = now;
  trip_.seq = trip_seq_;
  if (Publish(*context_.sink, trip_channel_, trip_)) ++trip_seq_;
}

namespace {

std::int32_t Narrow(std::int64_t ns) {
  return static_cast<std::int32_t>(std::clamp<std::int64_t>(ns, INT32_MIN, INT32_MAX));
}

constexpr double kUnknown = std::numeric_limits<double>::quiet_NaN();

constexpr MonoNs kShown = 60 * kSecond;  // how long an alarm about a single event stays

}  // namespace

PublishPace::PublishPace(double publish_hz, double poll_hz, std::int64_t ticks)
    : every_(poll_hz > 0 && publish_hz >= poll_hz),
      ticks_(ticks),
      period_(publish_hz > 0 ? static_cast<MonoNs>(static_cast<double>(kSecond) / publish_hz) : kNever),
      due_(publish_hz > 0 ? 0 : kNever) {}

bool PublishPace::Due(MonoNs at, std::int64_t tick) {
  if (every_) return true;
  if (ticks_ > 0 && tick >= 0) {
    // After a reading of a due tick was missed, the next one is published. A number that is far below means another base.
    const bool begins_again = due_tick_ - tick > ticks_;
    if (tick < due_tick_ && !begins_again) return false;
    due_tick_ = (tick / ticks_ + 1) * ticks_;
    due_ = at + period_;
    return true;
  }
  if (at < due_) return false;
  due_ = at - due_ < period_ ? due_ + period_ : at + period_;
  return true;
}

bool PublishPace::Good(MonoNs at, std::int32_t flags, std::int32_t epoch, std::int64_t tick) {
  const std::int32_t state = flags & kStateFlags;
  bool send = Due(at, tick) || doubt_shown_ || !any_ || epoch != epoch_;
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

void Block::Clear() {
  message_.n = 0;
  message_.missed = 0;
  message_.dt_ns.clear();
  message_.time_uncertainty_ns.clear();
  message_.counts.clear();
  message_.flags.clear();
}

PositionOutput::PositionOutput(const BusConfig& bus, const DeviceConfig& device, const Axis& axis,
                               const DevicePublisherContext& context)
    : axis_(axis),
      time_(*context.time),
      sink_(*context.sink),
      flags_((bus.simulate ? position_t::FLAG_SIMULATED : 0) |
             (context.redecoded ? position_t::FLAG_REDECODED : 0)),
      channel_("POSITION/" + device.name),
      block_channel_("POSITION_BLOCK/" + device.name),
      pace_(device.publish_hz, bus.poll_hz, TicksPerMessage(bus, device)),
      position_{} {
  context.origin.Set(position_);
  position_.counts_per_turn = device.settings->counts_per_turn;
  position_.unit = device.unit;
  if (device.block) {
    block_.emplace(device.settings->counts_per_turn, device.unit, axis.scale().unit_per_count());
    context.origin.Set(block_->message());
  }
}

void PositionOutput::Miss() {
  tick_ = kNoTick;
  ++position_.missed;
  gap_ = any_good_;
  if (block_) block_->Miss();
}

void PositionOutput::Take(const Sample& sample, const AxisReading& reading) {
  const MonoNs at = sample.at.Middle();
  position_.tick = std::exchange(tick_, kNoTick);
  if (sample.has_turns) position_.raw_turns = sample.turns;
  switch (reading.kind) {
    case AxisReading::Kind::kWithheld:
      return Miss();
    case AxisReading::Kind::kDoubtful:
      gap_ = any_good_;
      if (block_) AddToBlock(sample, reading, reading.flags | flags_);
      if (!pace_.Doubtful(at)) {
        ++position_.missed;
        return;
      }
      return SendPosition(sample, reading, reading.flags | flags_);
    case AxisReading::Kind::kGood:
      break;
  }
  any_good_ = true;
  const bool after_gap = std::exchange(gap_, false);
  gap_to_send_ = gap_to_send_ || after_gap;
  const std::int32_t flags = reading.flags | flags_;
  if (block_) AddToBlock(sample, reading, flags | (after_gap ? position_t::FLAG_AFTER_GAP : 0));
  if (!pace_.Good(at, flags, axis_.reference().epoch(), position_.tick)) return;
  SendPosition(sample, reading, flags | (std::exchange(gap_to_send_, false) ? position_t::FLAG_AFTER_GAP : 0));
}

void PositionOutput::SendPosition(const Sample& sample, const AxisReading& reading, std::int32_t flags) {
  const bool valid = (flags & position_t::FLAG_VALID) != 0;
  position_.mono_ns = sample.at.Middle();
  position_.utime = time_.Utime(position_.mono_ns);
  position_.time_uncertainty_ns = Narrow(sample.at.HalfWidth());
  position_.raw_counts = sample.counts;
  position_.counts = reading.counts;
  position_.angle_rad = valid ? axis_.scale().AngleRad(reading.counts) : kUnknown;
  position_.value = valid ? axis_.scale().Value(reading.counts) : kUnknown;
  position_.speed_rad_s = valid ? axis_.SpeedRadS() : kUnknown;
  position_.device_status = sample.device_status;
  position_.datum_epoch = axis_.reference().epoch();
  position_.flags = flags;
  if (!std::isnan(position_.speed_rad_s)) position_.flags |= position_t::FLAG_SPEED_VALID;
  if (std::exchange(clock_stepped_, false)) position_.flags |= position_t::FLAG_CLOCK_STEPPED;
  Publish(sink_, channel_, position_);
  ++position_.seq;
  position_.missed = 0;
}

void PositionOutput::AddToBlock(const Sample& sample, const AxisReading& reading, std::int32_t flags) {
  const std::int32_t epoch = axis_.reference().epoch();
  if (block_->MustGoBefore(sample.at.Middle(), epoch)) SendBlock();
  if (std::exchange(clock_stepped_in_block_, false)) flags |= position_t::FLAG_CLOCK_STEPPED;
  block_->Add(sample.at, reading.counts, flags, epoch);
  if (block_->Full()) SendBlock();
}

void PositionOutput::SendBlock() {
  position_block_t& message = block_->message();
  message.utime = time_.Utime(message.mono_ns);
  Publish(sink_, block_channel_, message);
  ++message.seq;
  block_->Clear();
}

bool DevicePublisher::PublishTimer::Due(std::int64_t revision, MonoNs at) {
  constexpr MonoNs kMinInterval = 20 * kMillisecond;  // between two messages after changes
  if (sent_ && at - sent_at_ < (revision == sent_revision_ ? kSecond : kMinInterval)) return false;
  sent_ = true;
  sent_at_ = at;
  sent_revision_ = revision;
  return true;
}

DevicePublisher::DevicePublisher(const BusConfig& bus, const DeviceConfig& device, DevicePublisherContext context)
    : context_(std::move(context)),
      name_(device.name),
      axis_(device),
      output_(bus, device, axis_, context_),
      motor_(name_, device.publish_hz, context_, bus.simulate),
      health_(PollPeriod(bus, device)),
      report_(bus, device, context_.origin),
      alarms_(device.alarm_stays_from) {
  context_.origin.Set(alarm_message_);
  alarm_message_.device = name_;
}

void DevicePublisher::UpdateAlarms() {
  const Reference& reference = axis_.reference();
  const AxisState axis{reference.lost(), axis_.outside(), reference.epoch(), axis_.unexplained_jumps()};
  if (axis == seen_axis_ && seen_health_ == health_.revision() && seen_alarms_ == alarms_.revision()) return;
  if (axis != seen_axis_) {
    ++axis_revision_;
    if (axis.jumps != seen_axis_.jumps) jump_until_ = now_ + kShown;
    seen_axis_ = axis;
  }
  const bool offline = health_.state() == device_info_t::STATE_OFFLINE;
  alarms_.SetOffline(offline);
  RaiseWhile(offline, runtime_alarms::kDeviceOffline);
  alarms_.Set(runtime_alarms::kReferenceLost, axis.lost ? AlarmState::kDriverLatched : AlarmState::kAbsent,
              NowUnixUs());
  RaiseWhile(axis.outside, runtime_alarms::kTurnsPassedEnd);
  RaiseWhile(now_ < jump_until_, runtime_alarms::kPositionJumped);
  const AlarmSpec* worst = alarms_.Worst(alarm_entry_t::SEVERITY_ERROR);
  health_.SetAlarm(worst != nullptr ? worst->name : "");
  seen_health_ = health_.revision();
  seen_alarms_ = alarms_.revision();
}

void DevicePublisher::UpdateTimedAlarms() {
  RaiseWhile(now_ < jump_until_, runtime_alarms::kPositionJumped);
  RaiseWhile(now_ < clock_stepped_until_, runtime_alarms::kClockStepped);
  RaiseWhile(health_.implausible_burst(), runtime_alarms::kImplausibleBurst);
  RaiseWhile(health_.stray_burst(), runtime_alarms::kUnexpectedBytes);
  alarms_.Tick(NowUnixUs());
}

void DevicePublisher::PublishDue() {
  UpdateAlarms();
  if (device_timer_.Due(health_.revision() + report_.revision() + axis_revision_, now_)) {
    const auto claim = context_.base == nullptr ? std::nullopt : context_.base->At(now_);
    report_.SetTickBase(claim ? claim->base_id : 0);
    Publish(*context_.sink, device_channel_, report_.Write(health_, axis_.reference(), *context_.time, now_));
  }
  if (alarm_timer_.Due(alarms_.revision(), now_)) {
    alarm_message_.mono_ns = now_;
    alarm_message_.utime = NowUnixUs();
    alarms_.Write(alarm_message_, alarm_message_.utime);
    Publish(*context_.sink, alarm_channel_, alarm_message_);
    ++alarm_message_.seq;
  }
}

void DevicePublisher::OnSample(const Sample& sample) {
  AdvanceTime(sample.at.last);
  const AxisReading reading = axis_.Take(sample);
  if (reading.kind == AxisReading::Kind::kGood) health_.OnGood(sample.at.last);
  if (reading.kind == AxisReading::Kind::kDoubtful) {
    health_.OnDoubtful(sample.error ? ErrorKind::kDevice : ErrorKind::kImplausible, sample.at.last);
  }
  output_.Take(sample, reading);
  PublishDue();
}

void DevicePublisher::OnMotor(const MotorReading& reading) {
  const MonoNs at = std::max(reading.analog_at.last, reading.status_at.last);
  AdvanceTime(at);
  health_.OnGood(at);
  motor_.Take(reading);
  PublishDue();
}

void DevicePublisher::OnTrip(const TripRecord& record) {
  AdvanceTime(record.at.last);
  motor_.Take(record);
}

void DevicePublisher::OnMotorLimits(const MotorLimits& limits) {
  AdvanceTime(limits.at.last);
  motor_.Take(limits, now_);
}

void DevicePublisher::OnError(ErrorKind kind, Interval at) {
  AdvanceTime(at.last);
  health_.OnFailure(kind, at.last);
  if (kind != ErrorKind::kUnexpectedBytes) output_.Miss();
  PublishDue();
}

void DevicePublisher::OnAlarm(const AlarmSpec& alarm, AlarmState state, MonoNs now) {
  AdvanceTime(now);
  alarms_.Set(alarm, state, NowUnixUs());
}

void DevicePublisher::OnLink(bool up, std::string_view reason, MonoNs now) {
  AdvanceTime(now);
  health_.OnLink(up, reason, now);
  if (!up) output_.Interrupt();
  RaiseWhile(!up, runtime_alarms::kLinkDown);
  PublishDue();
}

void DevicePublisher::Tick(MonoNs now) {
  AdvanceTime(now);
  health_.Tick(now);
  UpdateTimedAlarms();
  output_.Tick(now);
  motor_.Tick(now);
  PublishDue();
}

void DevicePublisher::OnClockStepped() {
  clock_stepped_until_ = now_ + kShown;
  output_.OnClockStepped();
}

void DevicePublisher::SetDatum(std::int64_t counts, std::int64_t unix_us) {
  // Converts the timestamp to CLOCK_MONOTONIC. A value far from now is limited, so that the sum does not overflow.
  constexpr std::int64_t kFarUs = INT64_C(1'000'000'000'000'000);
  const std::int64_t now_us = NowUnixUs();
  const std::int64_t ago_us = std::clamp(unix_us, now_us - kFarUs, now_us + kFarUs) - now_us;
  axis_.SetDatum({counts, unix_us}, now_ + ago_us * kMicrosecond, now_);
}

std::optional<std::int64_t> DevicePublisher::DatumFor(double value) const {
  const std::int8_t state = health_.state();
  if (state != device_info_t::STATE_ONLINE && state != device_info_t::STATE_DEGRADED) return std::nullopt;
  return axis_.DatumFor(value);
}

DevicePublisher::Summary DevicePublisher::summary() const {
  const Reference& reference = axis_.reference();
  const std::optional<std::int64_t> counts = axis_.Counts();
  Summary summary;
  summary.state = health_.state();
  summary.datum_epoch = reference.epoch();
  summary.reference_lost = reference.lost();
  summary.value = counts ? axis_.scale().Value(*counts) : std::numeric_limits<double>::quiet_NaN();
  summary.identity = report_.identity();
  if (reference.has_datum()) summary.datum = Reference::Datum{reference.datum(), reference.datum_unix_us()};
  summary.file_datum = reference.of_file();
  if (const auto position = axis_.LastValid()) {
    summary.position = {position->counts, context_.time->Utime(position->at.Middle())};
  }
  return summary;
}

}  // namespace axlecast
