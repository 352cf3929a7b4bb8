#include "drivers/runtime/axis/device_publisher.h"

#include <algorithm>
#include <axlecast/alarm_t.hpp>
#include <axlecast/device_info_t.hpp>
#include <limits>
#include <utility>

#include "core/alarm/alarm_codes.h"
#include "drivers/runtime/axis/axis.h"
#include "drivers/runtime/axis/device_health.h"
#include "drivers/runtime/axis/motor_output.h"
#include "drivers/runtime/axis/position_output.h"

namespace axlecast {
namespace {

constexpr MonoNs kShown = 60 * kSecond;  // how long an alarm about a single event stays

PositionOutput::Context OutputContext(const BusConfig& bus, const DevicePublisherContext& context) {
  const std::int32_t simulated = bus.simulate ? position_t::FLAG_SIMULATED : 0;
  const std::int32_t redecoded = context.redecoded ? position_t::FLAG_REDECODED : 0;
  return {context.boot_id, context.time, context.sink, simulated | redecoded};
}

}  // namespace

struct DevicePublisher::State {
  // When a message is due that is sent once per second and on changes: DEVICE and ALARM.
  class PublishTimer {
   public:
    // `revision`: of the content of the message.
    [[nodiscard]] bool Due(std::int64_t revision, MonoNs at) {
      constexpr MonoNs kMinInterval = 20 * kMillisecond;  // between two messages after changes
      if (sent_ && at - sent_at_ < (revision == sent_revision_ ? kSecond : kMinInterval)) return false;
      sent_ = true;
      sent_at_ = at;
      sent_revision_ = revision;
      return true;
    }

   private:
    bool sent_ = false;
    MonoNs sent_at_ = 0;
    std::int64_t sent_revision_ = 0;
  };

  State(const BusConfig& bus, const DeviceConfig& device, DevicePublisherContext given)
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

  void AdvanceTime(MonoNs at) { now = std::max(now, at); }
  [[nodiscard]] std::int64_t NowUnixUs() const { return context.time->Utime(now); }
  void Raise(const AlarmSpec& alarm, AlarmState state) { alarms.Set(alarm, state, NowUnixUs()); }
  void RaiseWhile(bool present, const AlarmSpec& alarm) {
    Raise(alarm, present ? AlarmState::kLive : AlarmState::kAbsent);
  }
  void UpdateAlarms();
  void UpdateTimedAlarms();
  void PublishDue();

  DevicePublisherContext context;
  std::string name;
  std::string device_channel;
  std::string alarm_channel;
  Axis axis;
  PositionOutput output;
  MotorOutput motor;
  DeviceHealth health;
  DeviceReport report;
  AlarmTable alarms;
  alarm_t alarm_message{};
  PublishTimer device_times;
  PublishTimer alarm_times;
  MonoNs now = 0;  // the latest time of an event
  std::int64_t unexplained_jumps = 0;
  MonoNs jump_until = 0;
  MonoNs clock_stepped_until = 0;

  // The state at the last UpdateAlarms.
  std::int64_t seen_health = -1;
  std::int64_t seen_alarms = -1;
  bool seen_lost = false;
  bool seen_outside = false;
  std::int32_t seen_epoch = 0;
  std::int64_t axis_revision = 0;
};

// The alarms follow from the state, and DeviceHealth's state from the alarms.
void DevicePublisher::State::UpdateAlarms() {
  const Reference& reference = axis.reference();
  const bool axis_same = seen_lost == reference.lost() && seen_outside == axis.outside() &&
                         seen_epoch == reference.epoch() && unexplained_jumps == axis.unexplained_jumps();
  if (axis_same && seen_health == health.revision() && seen_alarms == alarms.revision()) return;
  if (!axis_same) {
    ++axis_revision;
    if (unexplained_jumps != axis.unexplained_jumps()) jump_until = now + kShown;
    unexplained_jumps = axis.unexplained_jumps();
    seen_lost = reference.lost();
    seen_outside = axis.outside();
    seen_epoch = reference.epoch();
  }
  const bool offline = health.state() == device_info_t::STATE_OFFLINE;
  alarms.SetOffline(offline);
  RaiseWhile(offline, runtime_alarms::kDeviceOffline);
  Raise(runtime_alarms::kReferenceLost, seen_lost ? AlarmState::kDriverLatched : AlarmState::kAbsent);
  RaiseWhile(seen_outside, runtime_alarms::kTurnsPassedEnd);
  RaiseWhile(now < jump_until, runtime_alarms::kPositionJumped);
  const AlarmSpec* worst = alarms.Worst(alarm_entry_t::SEVERITY_ERROR);
  health.SetAlarm(worst != nullptr ? worst->name : "");
  seen_health = health.revision();
  seen_alarms = alarms.revision();
}

// Updates the alarms that end after a time.
void DevicePublisher::State::UpdateTimedAlarms() {
  RaiseWhile(now < jump_until, runtime_alarms::kPositionJumped);
  RaiseWhile(now < clock_stepped_until, runtime_alarms::kClockStepped);
  RaiseWhile(health.implausible_burst(), runtime_alarms::kImplausibleBurst);
  RaiseWhile(health.stray_burst(), runtime_alarms::kUnexpectedBytes);
  alarms.Tick(NowUnixUs());
}

void DevicePublisher::State::PublishDue() {
  UpdateAlarms();
  if (device_times.Due(health.revision() + report.revision() + axis_revision, now)) {
    Publish(*context.sink, device_channel, report.Write(health, axis.reference(), *context.time, now));
  }
  if (alarm_times.Due(alarms.revision(), now)) {
    alarm_message.mono_ns = now;
    alarm_message.utime = NowUnixUs();
    alarms.Write(alarm_message, alarm_message.utime);
    Publish(*context.sink, alarm_channel, alarm_message);
    ++alarm_message.seq;
  }
}

DevicePublisher::DevicePublisher(const BusConfig& bus, const DeviceConfig& device, DevicePublisherContext context)
    : state_(std::make_unique<State>(bus, device, std::move(context))) {}
DevicePublisher::~DevicePublisher() = default;

void DevicePublisher::OnSample(const Sample& sample) {
  State& s = *state_;
  s.AdvanceTime(sample.at.last);
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

void DevicePublisher::OnMotor(const MotorReading& reading) {
  const MonoNs at = std::max(reading.analog_at.last, reading.status_at.last);
  state_->AdvanceTime(at);
  state_->health.OnGood(at);
  state_->motor.Take(reading);
  state_->PublishDue();
}

void DevicePublisher::OnTrip(const TripRecord& record) {
  state_->AdvanceTime(record.at.last);
  state_->motor.Take(record);
}

void DevicePublisher::OnMotorLimits(const MotorLimits& limits) {
  state_->AdvanceTime(limits.at.last);
  state_->motor.Take(limits, state_->now);
}

void DevicePublisher::OnProductCode(std::string_view code) { state_->report.SetProductCode(code); }

void DevicePublisher::OnError(ErrorKind kind, Interval at) {
  state_->AdvanceTime(at.last);
  state_->health.OnFailure(kind, at.last);
  if (kind != ErrorKind::kUnexpectedBytes) state_->output.Miss();
  state_->PublishDue();
}

void DevicePublisher::OnAlarm(const AlarmSpec& alarm, AlarmState state, MonoNs now) {
  state_->AdvanceTime(now);
  state_->Raise(alarm, state);
}

void DevicePublisher::OnIdentity(std::int64_t identity, std::string_view serial, std::string_view firmware) {
  state_->report.SetIdentity(identity, serial, firmware);
}

void DevicePublisher::OnStarting(std::string_view reason) { state_->health.OnStarting(reason, state_->now); }

void DevicePublisher::OnRefused(std::string_view reason) { state_->health.OnRefused(reason, state_->now); }

void DevicePublisher::OnNonVolatileWrite() { state_->report.CountNonVolatileWrite(); }

void DevicePublisher::OnReferenceLost() { state_->axis.OnReferenceLost(state_->now); }

void DevicePublisher::OnReferenceRestored() { state_->axis.OnReferenceRestored(); }

void DevicePublisher::OnJump() { state_->axis.OnJump(); }

void DevicePublisher::OnDatumChanging(bool changing) { state_->axis.OnDatumChanging(changing); }

void DevicePublisher::OnOutcome(const CommandId& id, const Outcome& outcome) {
  if (state_->context.on_outcome) state_->context.on_outcome(state_->name, id, outcome);
}

Motion DevicePublisher::MotionAt(MonoNs now) const { return state_->axis.MotionAt(now); }

void DevicePublisher::OnLink(bool up, std::string_view reason, MonoNs now) {
  state_->AdvanceTime(now);
  state_->health.OnLink(up, reason, now);
  if (!up) state_->output.Interrupt();
  state_->RaiseWhile(!up, runtime_alarms::kLinkDown);
  state_->PublishDue();
}

void DevicePublisher::Tick(MonoNs now) {
  state_->AdvanceTime(now);
  state_->health.Tick(now);
  state_->UpdateTimedAlarms();
  state_->output.Tick(now);
  state_->motor.Tick(now);
  state_->PublishDue();
}

void DevicePublisher::OnClockStepped() {
  state_->clock_stepped_until = state_->now + kShown;
  state_->output.OnClockStepped();
}

void DevicePublisher::SetDatum(std::int64_t counts, std::int64_t unix_us) {
  // Converts the timestamp to CLOCK_MONOTONIC. A value far from now is limited, so that the sum does not overflow.
  constexpr std::int64_t kFarUs = INT64_C(1'000'000'000'000'000);
  const std::int64_t now_us = state_->NowUnixUs();
  const std::int64_t ago_us = std::clamp(unix_us, now_us - kFarUs, now_us + kFarUs) - now_us;
  state_->axis.SetDatum({counts, unix_us}, state_->now + ago_us * kMicrosecond, state_->now);
}

void DevicePublisher::ClearDatum() { state_->axis.ClearDatum(); }

std::optional<double> DevicePublisher::ValueWith(std::int64_t datum_counts) const {
  return state_->axis.ValueWith(datum_counts);
}

std::optional<std::int64_t> DevicePublisher::DatumFor(double value) const {
  const std::int8_t state = state_->health.state();
  if (state != device_info_t::STATE_ONLINE && state != device_info_t::STATE_DEGRADED) return std::nullopt;
  return state_->axis.DatumFor(value);
}

DevicePublisher::Summary DevicePublisher::summary() const {
  const Reference& reference = state_->axis.reference();
  const std::optional<std::int64_t> counts = state_->axis.Counts();
  Summary summary;
  summary.state = state_->health.state();
  summary.datum_epoch = reference.epoch();
  summary.reference_lost = reference.lost();
  summary.value = counts ? state_->axis.scale().Value(*counts) : std::numeric_limits<double>::quiet_NaN();
  summary.identity = state_->report.identity();
  if (reference.has_datum()) summary.datum = Reference::Datum{reference.datum(), reference.datum_unix_us()};
  summary.file_datum = reference.of_file();
  if (const auto position = state_->axis.LastValid()) {
    summary.position = {position->counts, state_->context.time->Utime(position->at.Middle())};
  }
  return summary;
}

AlarmTable& DevicePublisher::alarms() { return state_->alarms; }
const AlarmTable& DevicePublisher::alarms() const { return state_->alarms; }

std::int64_t DevicePublisher::good() const { return state_->health.good(); }

std::int64_t DevicePublisher::nv_writes() const { return state_->report.nv_writes(); }

std::int64_t DevicePublisher::errors(ErrorKind kind) const { return state_->health.errors(kind); }

}  // namespace axlecast
