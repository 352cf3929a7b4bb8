#include "drivers/runtime/axis/motor_output.h"

#include <algorithm>
#include <cmath>
#include <iterator>

#include "core/base/text.h"

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

MotorOutput::MotorOutput(const std::string& device, double publish_hz, Context context)
    : context_(context),
      period_(publish_hz > 0 ? static_cast<MonoNs>(kEarly * static_cast<double>(kSecond) / publish_hz) : 0),
      motor_channel_("MOTOR/" + device),
      trip_channel_("TRIP/" + device),
      limits_channel_("LIMITS/" + device) {
  motor_.boot_id = context.boot_id;
  trip_.boot_id = context.boot_id;
  limits_.boot_id = context.boot_id;
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
  motor_.flags = FlagsOf(reading) | (context_.simulated ? motor_health_t::FLAG_SIMULATED : 0) |
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
  message.flags = (context_.simulated ? motor_limits_t::FLAG_SIMULATED : 0) |
                  (context_.redecoded ? motor_limits_t::FLAG_REDECODED : 0);
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

}  // namespace axlecast
