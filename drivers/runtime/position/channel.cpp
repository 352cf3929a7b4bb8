#include "drivers/runtime/position/channel.h"

#include <algorithm>
#include <axlecast/alarm_t.hpp>
#include <axlecast/device_info_t.hpp>
#include <limits>
#include <utility>

#include "drivers/runtime/motor/motor_output.h"
#include "drivers/runtime/position/axis.h"
#include "drivers/runtime/position/device_health.h"
#include "drivers/runtime/position/device_report.h"
#include "drivers/runtime/position/position_output.h"
#include "drivers/runtime/position/repeated.h"
#include "drivers/runtime/position/runtime_alarms.h"

namespace axlecast {
namespace {

constexpr MonoNs kShown = 60 * kSecond;  // how long an alarm about a single moment stays

PositionOutput::Context OutputContext(const BusConfig& bus, const ChannelContext& context) {
  const std::int32_t simulated = bus.simulate ? position_t::FLAG_SIMULATED : 0;
  const std::int32_t redecoded = context.redecoded ? position_t::FLAG_REDECODED : 0;
  return {context.boot_id, context.time, context.sink, simulated | redecoded};
}

}  // namespace

struct Channel::State {
  State(const BusConfig& bus, const DeviceConfig& device, ChannelContext given)
      : context(std::move(given)),
        name(device.name),
        device_channel("DEVICE/" + device.name),
        alarm_channel("ALARM/" + device.name),
        axis(device),
        output(bus, device, axis, OutputContext(bus, context)),
        motor(device.name, device.publish_hz,
              {context.boot_id, context.time, context.sink, bus.simulate, context.redecoded}),
        health(PollPeriod(bus, device)),
        report(bus, device, context.boot_id),
        alarms(device.alarm_stays_from) {
    alarm_message.boot_id = context.boot_id;
    alarm_message.device = device.name;
  }

  void See(MonoNs at) { now = std::max(now, at); }
  [[nodiscard]] std::int64_t Utime() const { return context.time->Utime(now); }
  void Raise(const AlarmSpec& alarm, AlarmState state) { alarms.Set(alarm, state, Utime()); }
  void RaiseWhile(bool present, const AlarmSpec& alarm) {
    Raise(alarm, present ? AlarmState::kLive : AlarmState::kAbsent);
  }
  void Judge();
  void JudgeMoments();
  void PublishDue();

  ChannelContext context;
  std::string name;
  std::string device_channel;
  std::string alarm_channel;
  Axis axis;
  PositionOutput output;
  MotorOutput motor;
  DeviceHealth health;
  DeviceReport report;
  AlarmBook alarms;
  alarm_t alarm_message{};
  Repeated device_times;
  Repeated alarm_times;
  MonoNs now = 0;  // the latest instant heard of
  std::int64_t surprises = 0;
  MonoNs surprise_until = 0;
  MonoNs clock_stepped_until = 0;

  // What Judge last drew its conclusions from.
  std::int64_t judged_health = -1;
  std::int64_t judged_alarms = -1;
  bool judged_lost = false;
  bool judged_outside = false;
  std::int32_t judged_epoch = 0;
  std::int64_t axis_revision = 0;
};

// Alarms follow from the state, and the state from the alarms.
void Channel::State::Judge() {
  const Reference& reference = axis.reference();
  const bool axis_same = judged_lost == reference.lost() && judged_outside == axis.outside() &&
                         judged_epoch == reference.epoch() && surprises == axis.surprises();
  if (axis_same && judged_health == health.revision() && judged_alarms == alarms.revision()) return;
  if (!axis_same) {
    ++axis_revision;
    if (surprises != axis.surprises()) surprise_until = now + kShown;
    surprises = axis.surprises();
    judged_lost = reference.lost();
    judged_outside = axis.outside();
    judged_epoch = reference.epoch();
  }
  const bool offline = health.state() == device_info_t::STATE_OFFLINE;
  alarms.SetOffline(offline);
  RaiseWhile(offline, runtime_alarms::kDeviceOffline);
  Raise(runtime_alarms::kReferenceLost, judged_lost ? AlarmState::kDriverLatched : AlarmState::kAbsent);
  RaiseWhile(judged_outside, runtime_alarms::kTurnsPassedEnd);
  RaiseWhile(now < surprise_until, runtime_alarms::kPositionJumped);
  const AlarmSpec* worst = alarms.Worst(alarm_entry_t::SEVERITY_ERROR);
  health.SetAlarm(worst != nullptr ? worst->name : "");
  judged_health = health.revision();
  judged_alarms = alarms.revision();
}

// Alarms that time alone ends.
void Channel::State::JudgeMoments() {
  RaiseWhile(now < surprise_until, runtime_alarms::kPositionJumped);
  RaiseWhile(now < clock_stepped_until, runtime_alarms::kClockStepped);
  RaiseWhile(health.implausible_burst(), runtime_alarms::kImplausibleBurst);
  RaiseWhile(health.stray_burst(), runtime_alarms::kUnexpectedBytes);
  alarms.Tick(Utime());
}

void Channel::State::PublishDue() {
  Judge();
  if (device_times.Due(health.revision() + report.revision() + axis_revision, now)) {
    Publish(*context.sink, device_channel, report.Write(health, axis.reference(), *context.time, now));
  }
  if (alarm_times.Due(alarms.revision(), now)) {
    alarm_message.mono_ns = now;
    alarm_message.utime = Utime();
    alarms.Write(alarm_message, alarm_message.utime);
    Publish(*context.sink, alarm_channel, alarm_message);
    ++alarm_message.seq;
  }
}

Channel::Channel(const BusConfig& bus, const DeviceConfig& device, ChannelContext context)
    : state_(std::make_unique<State>(bus, device, std::move(context))) {}
Channel::~Channel() = default;

void Channel::OnSample(const Sample& sample) {
  State& s = *state_;
  s.See(sample.at.last);
  const AxisReading reading = s.axis.Take(sample);
  switch (reading.kind) {
    case AxisReading::Kind::kGood:
      s.health.OnGood(sample.at.last);
      break;
    case AxisReading::Kind::kDoubtful:
      s.health.OnDoubtful(sample.error ? ErrorKind::kDevice : ErrorKind::kImplausible, sample.at.last);
      break;
    case AxisReading::Kind::kWithheld:
      break;
  }
  s.output.Take(sample, reading);
  s.PublishDue();
}

void Channel::OnMotor(const MotorReading& reading) {
  const MonoNs at = std::max(reading.analog_at.last, reading.status_at.last);
  state_->See(at);
  state_->health.OnGood(at);
  state_->motor.Take(reading);
  state_->PublishDue();
}

void Channel::OnTrip(const TripRecord& record) {
  state_->See(record.at.last);
  state_->motor.Take(record);
}

void Channel::OnMotorLimits(const MotorLimits& limits) {
  state_->See(limits.at.last);
  state_->motor.Take(limits, state_->now);
}

void Channel::OnProductCode(std::string_view code) { state_->report.SetProductCode(code); }

void Channel::OnError(ErrorKind kind, Interval at) {
  state_->See(at.last);
  state_->health.OnFailure(kind, at.last);
  if (kind != ErrorKind::kStray) state_->output.Miss();
  state_->PublishDue();
}

void Channel::OnAlarm(const AlarmSpec& alarm, AlarmState state, MonoNs now) {
  state_->See(now);
  state_->Raise(alarm, state);
}

void Channel::OnIdentity(std::int64_t identity, std::string_view serial, std::string_view firmware) {
  state_->report.SetIdentity(identity, serial, firmware);
}

void Channel::OnStarting(std::string_view reason) { state_->health.OnStarting(reason, state_->now); }

void Channel::OnRefused(std::string_view reason) { state_->health.OnRefused(reason, state_->now); }

void Channel::OnNonVolatileWrite() { state_->report.CountNonVolatileWrite(); }

void Channel::OnReferenceLost() { state_->axis.OnReferenceLost(state_->now); }

void Channel::OnReferenceRestored() { state_->axis.OnReferenceRestored(); }

void Channel::OnJump() { state_->axis.OnJump(); }

void Channel::OnDatumChanging(bool changing) { state_->axis.OnDatumChanging(changing); }

void Channel::OnOutcome(const CommandId& id, const Outcome& outcome) {
  if (state_->context.on_outcome) state_->context.on_outcome(state_->name, id, outcome);
}

Motion Channel::MotionAt(MonoNs now) const { return state_->axis.MotionAt(now); }

void Channel::OnLink(bool up, std::string_view reason, MonoNs now) {
  state_->See(now);
  state_->health.OnLink(up, reason, now);
  if (!up) state_->output.Interrupt();
  state_->RaiseWhile(!up, runtime_alarms::kLinkDown);
  state_->PublishDue();
}

void Channel::Tick(MonoNs now) {
  state_->See(now);
  state_->health.Tick(now);
  state_->JudgeMoments();
  state_->output.Tick(now);
  state_->motor.Tick(now);
  state_->PublishDue();
}

void Channel::OnClockStepped() {
  state_->clock_stepped_until = state_->now + kShown;
  state_->output.OnClockStepped();
}

void Channel::SetDatum(std::int64_t counts, std::int64_t utime) {
  // The stamp on CLOCK_MONOTONIC; a wild one is only as far away as it needs to be.
  constexpr std::int64_t kFarUs = INT64_C(1'000'000'000'000'000);
  const std::int64_t now_us = state_->Utime();
  const std::int64_t ago_us = std::clamp(utime, now_us - kFarUs, now_us + kFarUs) - now_us;
  state_->axis.SetDatum({counts, utime}, state_->now + ago_us * kMicrosecond, state_->now);
}

void Channel::ClearDatum() { state_->axis.ClearDatum(); }

std::optional<double> Channel::ValueWith(std::int64_t datum_counts) const {
  return state_->axis.ValueWith(datum_counts);
}

std::optional<std::int64_t> Channel::DatumFor(double value) const {
  const std::int8_t state = state_->health.state();
  if (state != device_info_t::STATE_ONLINE && state != device_info_t::STATE_DEGRADED) return std::nullopt;
  return state_->axis.DatumFor(value);
}

Channel::Summary Channel::summary() const {
  const Reference& reference = state_->axis.reference();
  const std::optional<std::int64_t> counts = state_->axis.Counts();
  Summary summary;
  summary.state = state_->health.state();
  summary.datum_epoch = reference.epoch();
  summary.reference_lost = reference.lost();
  summary.value = counts ? state_->axis.scale().Value(*counts) : std::numeric_limits<double>::quiet_NaN();
  summary.identity = state_->report.identity();
  if (reference.has_datum()) summary.datum = Reference::Datum{reference.datum(), reference.utime()};
  summary.file_datum = reference.of_file();
  if (const auto position = state_->axis.LastValid()) {
    summary.position = {position->counts, state_->context.time->Utime(position->at.Middle())};
  }
  return summary;
}

AlarmBook& Channel::alarms() { return state_->alarms; }
const AlarmBook& Channel::alarms() const { return state_->alarms; }

std::int64_t Channel::good() const { return state_->health.good(); }

std::int64_t Channel::nv_writes() const { return state_->report.nv_writes(); }

std::int64_t Channel::errors(ErrorKind kind) const { return state_->health.errors(kind); }

}  // namespace axlecast
