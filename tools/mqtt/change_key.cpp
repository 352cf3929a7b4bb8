#include "tools/mqtt/change_key.h"

#include <axlecast/alarm_t.hpp>
#include <axlecast/bus_health_t.hpp>
#include <axlecast/command_status_t.hpp>
#include <axlecast/device_info_t.hpp>
#include <axlecast/motor_health_t.hpp>
#include <axlecast/motor_limits_t.hpp>
#include <axlecast/position_t.hpp>
#include <axlecast/recorder_health_t.hpp>
#include <axlecast/trip_log_t.hpp>
#include <cmath>
#include <cstring>

#include "core/messages/message.h"

namespace axlecast {
namespace {

// They come and go from one reading to the next.
constexpr std::int32_t kPassing = std::int32_t{position_t::FLAG_AFTER_GAP} |
                                  std::int32_t{position_t::FLAG_CLOCK_STEPPED} |
                                  std::int32_t{position_t::FLAG_SPEED_VALID};

std::string Joined(const std::string& text) { return text + '\0'; }
template <typename Number>
std::string Joined(Number number) {
  return std::to_string(number) + ' ';
}
template <typename... Parts>
std::string Mark(const Parts&... parts) {
  return (Joined(parts) + ...);
}

ChangeKey Of(const position_t& m) { return {Mark(m.boot_id, m.datum_epoch, m.flags & ~kPassing), m.value}; }
ChangeKey Of(const motor_health_t& m) { return {Mark(m.boot_id, m.seq), 0}; }
ChangeKey Of(const alarm_t& m) { return {Mark(m.boot_id, m.revision), 0}; }
ChangeKey Of(const device_info_t& m) {
  return {Mark(m.boot_id, m.state, m.reason, m.model, m.serial, m.firmware, m.product_code, m.identity,
               m.config_hash, m.datum_epoch, m.reference_lost, m.nv_writes),
          0};
}
ChangeKey Of(const motor_limits_t& m) {
  std::string values(sizeof m.parameters, '\0');
  std::memcpy(values.data(), m.parameters, sizeof m.parameters);
  return {Mark(m.boot_id, m.power_upper_w[0], m.power_upper_w[1], m.power_lower_w[0], m.power_lower_w[1],
               m.start_time_s, m.shock_time_upper_s[0], m.shock_time_upper_s[1], m.shock_time_lower_s[0],
               m.shock_time_lower_s[1]) +
              values,
          0};
}
ChangeKey Of(const bus_health_t& m) { return {Mark(m.boot_id, m.state, m.reopens), 0}; }
ChangeKey Of(const recorder_health_t& m) { return {Mark(m.boot_id, m.state, m.file, m.lost, m.last_error), 0}; }
// A trip is told again and again, and after a restart of its driver.
ChangeKey Of(const trip_log_t& m) {
  std::string samples(sizeof m.samples, '\0');
  std::memcpy(samples.data(), m.samples, sizeof m.samples);
  return {Mark(m.trip_count, m.factor_bits, m.interval_us, m.valid_mask) + samples, 0};
}
ChangeKey Of(const command_status_t& m) {
  std::string id(sizeof m.id, '\0');
  std::memcpy(id.data(), m.id, sizeof m.id);
  return {id + Mark(m.state, m.finding), 0};
}

template <typename Message>
std::optional<ChangeKey> Decoded(Bytes bytes) {
  const std::optional<Message> message = DecodeMessage<Message>(bytes);
  if (!message) return std::nullopt;
  return Of(*message);
}

}  // namespace

std::optional<ChangeKey> NoveltyOf(std::string_view type, Bytes message) {
  if (type == "position_t") return Decoded<position_t>(message);
  if (type == "motor_health_t") return Decoded<motor_health_t>(message);
  if (type == "motor_limits_t") return Decoded<motor_limits_t>(message);
  if (type == "alarm_t") return Decoded<alarm_t>(message);
  if (type == "device_info_t") return Decoded<device_info_t>(message);
  if (type == "bus_health_t") return Decoded<bus_health_t>(message);
  if (type == "recorder_health_t") return Decoded<recorder_health_t>(message);
  if (type == "trip_log_t") return Decoded<trip_log_t>(message);
  if (type == "command_status_t") return Decoded<command_status_t>(message);
  return std::nullopt;
}

bool Differ(const ChangeKey& newer, const ChangeKey& older, double deadband) {
  if (newer.mark != older.mark) return true;
  if (std::isnan(newer.value) || std::isnan(older.value)) return std::isnan(newer.value) != std::isnan(older.value);
  return std::abs(newer.value - older.value) > deadband;
}

}  // namespace axlecast
