#include "tools/fleet/event_rows.h"

#include <sodium.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <iterator>
#include <optional>
#include <vector>

#include "core/base/text.h"
#include "core/messages/enum_names.h"
#include "core/messages/json/message_json.h"
#include "core/messages/origin.h"
#include "tools/log/log_event.h"

namespace axlecast {
namespace {

constexpr const char* kReplacement = "\xEF\xBF\xBD";  // U+FFFD

void ReplaceNul(nlohmann::ordered_json& json) {
  if (json.is_string()) {
    json = CleanText(json.get_ref<const std::string&>());
  } else if (json.is_structured()) {
    for (nlohmann::ordered_json& part : json) ReplaceNul(part);
  }
}

std::optional<double> Known(double value) { return std::isfinite(value) ? std::optional(value) : std::nullopt; }

// A list of numbers and texts, each with its end.
class StateKey {
 public:
  StateKey& Add(std::int64_t number) {
    key_ += std::to_string(number) + '\n';
    return *this;
  }
  StateKey& Add(const std::string& text) {
    key_ += std::to_string(text.size()) + ':' + text + '\n';
    return *this;
  }
  [[nodiscard]] std::string Take() { return std::move(key_); }

 private:
  std::string key_;
};

const char* IssuedState(std::int8_t mode) {
  switch (mode) {
    case command_body_t::MODE_PREPARE:
      return "prepare_issued";
    case command_body_t::MODE_COMMIT:
      return "commit_issued";
    case command_body_t::MODE_CANCEL:
      return "cancel_issued";
    default:
      return "issued";
  }
}

template <typename Value>
void AppendBytes(std::string& bytes, const Value& value) {
  bytes.append(reinterpret_cast<const char*>(&value), sizeof value);
}

}  // namespace

std::string CleanText(std::string_view text) {
  std::string clean = MendedUtf8(text);
  for (std::size_t at = clean.find('\0'); at != std::string::npos; at = clean.find('\0', at)) {
    clean.replace(at, 1, kReplacement);
  }
  return clean;
}

std::string JsonbText(nlohmann::ordered_json json) {
  std::string text = JsonLine(json);
  if (text.find("\\u0000") == std::string::npos) return text;
  ReplaceNul(json);
  return JsonLine(json);
}

FleetCommandRow CommandRowOf(const command_status_t& status) {
  FleetCommandRow row{.t = status.utime,
                      .device = CleanText(status.device),
                      .operation = CleanText(status.operation),
                      .state = std::string(StateName(status.state)),
                      .verified = status.verified != 0,
                      .reason_code = status.reason_code,
                      .reason = std::string(ReasonName(status.reason_code)),
                      .text = CleanText(status.text),
                      .boot_id = status.boot_id,
                      .seq = status.seq,
                      .started_utime = status.started_utime,
                      .finished_utime = status.finished_utime,
                      .message = JsonbText(ToJson(status))};
  std::copy(std::begin(status.id), std::end(status.id), row.id.begin());
  if (status.finding != command_status_t::FINDING_NONE) row.finding = FindingName(status.finding);
  return row;
}

FleetCommandRow CommandRowOf(const command_t& message, const command_body_t& body) {
  FleetCommandRow row{.t = message.utime,
                      .device = CleanText(body.device),
                      .operation = CleanText(body.operation),
                      .state = IssuedState(body.mode),
                      .reason = CleanText(body.reason),
                      .boot_id = message.boot_id,
                      .seq = message.seq,
                      .message = JsonbText(ToJson(body))};
  std::copy(std::begin(body.id), std::end(body.id), row.id.begin());
  if (body.key_id != 0) row.issued_by = Text("%016llx", static_cast<unsigned long long>(body.key_id));
  return row;
}

TripRow TripRowOf(const std::string& name, const trip_log_t& message) {
  std::string identity;
  AppendBytes(identity, message.trip_count);
  AppendBytes(identity, message.factor_bits);
  AppendBytes(identity, message.samples);
  return {.t = message.utime,
          .device = CleanText(name),
          .identity = NameHash(identity),
          .boot_id = message.boot_id,
          .trip_count = message.trip_count,
          .factor_bits = message.factor_bits,
          .not_before_utime = message.not_before_utime,
          .not_after_utime = message.not_after_utime,
          .interval_us = message.interval_us,
          .message = JsonbText(ToJson(message))};
}

DeviceHealthRow HealthRowOf(const std::string& name, const device_info_t& message) {
  DeviceHealthRow row{.t = message.utime,
                      .device = CleanText(name),
                      .boot_id = message.boot_id,
                      .seq = message.seq,
                      .state = message.state,
                      .bus = CleanText(message.bus),
                      .family = CleanText(message.family),
                      .model = CleanText(message.model),
                      .serial = CleanText(message.serial),
                      .firmware = CleanText(message.firmware),
                      .reason = CleanText(message.reason),
                      .datum_epoch = message.datum_epoch,
                      .reference_lost = message.reference_lost != 0,
                      .good = message.good,
                      .nv_writes = message.nv_writes,
                      .last_good_utime = message.last_good_utime,
                      .message = JsonbText(ToJson(message))};
  std::copy(std::begin(message.errors), std::end(message.errors), row.errors.begin());
  return row;
}

BusHealthRow HealthRowOf(const std::string& name, const bus_health_t& message) {
  BusHealthRow row{.t = message.utime,
                   .bus = CleanText(name),
                   .boot_id = message.boot_id,
                   .seq = message.seq,
                   .state = message.state,
                   .family = CleanText(message.family),
                   .port = CleanText(message.port),
                   .exchanges = message.exchanges,
                   .good = message.good,
                   .late = message.late,
                   .rx_dropped = message.rx_dropped,
                   .rate_hz = Known(message.rate_hz),
                   .utilisation = Known(message.utilisation),
                   .reopens = message.reopens,
                   .last_error = CleanText(message.last_error),
                   .message = JsonbText(ToJson(message))};
  std::copy(std::begin(message.errors), std::end(message.errors), row.errors.begin());
  return row;
}

RecorderHealthRow HealthRowOf(const std::string& name, const recorder_health_t& message) {
  return {.t = message.utime,
          .recorder = CleanText(name),
          .boot_id = message.boot_id,
          .seq = message.seq,
          .state = message.state,
          .file = CleanText(message.file),
          .messages = message.messages,
          .lost = message.lost,
          .kernel_dropped = message.kernel_dropped,
          .free_bytes = message.free_bytes,
          .last_error = CleanText(message.last_error),
          .message = JsonbText(ToJson(message))};
}

MotorHealthRow HealthRowOf(const std::string& name, const motor_health_t& message) {
  return {.t = message.utime,
          .device = CleanText(name),
          .boot_id = message.boot_id,
          .seq = message.seq,
          .voltage_v = Known(message.voltage_v),
          .current_a = Known(message.current_a),
          .power_w = Known(message.power_w),
          .temperature_c = Known(message.temperature_c),
          .accel_mps2 = {Known(message.accel_mps2[0]), Known(message.accel_mps2[1]), Known(message.accel_mps2[2])},
          .trip_count = message.trip_count,
          .status_bits = message.status_bits,
          .flags = message.flags,
          .message = JsonbText(ToJson(message))};
}

ClockRow HealthRowOf(const std::string& name, const time_quality_t& message) {
  return {.t = message.utime,
          .host = CleanText(name),
          .root = CleanText(message.root),
          .boot_id = message.boot_id,
          .seq = message.seq,
          .state = message.state,
          .grade = message.grade,
          .source = message.source,
          .base_id = message.base_id,
          .epoch = message.epoch,
          .half_width_ns = message.half_width_ns,
          .utc_grade = message.utc_grade,
          .utc_half_width_ns = message.utc_half_width_ns,
          .reason = CleanText(message.reason),
          .message = JsonbText(ToJson(message))};
}

std::string StateKeyOf(const device_info_t& message) {
  return StateKey()
      .Add(message.boot_id)
      .Add(message.state)
      .Add(message.reason)
      .Add(message.config_hash)
      .Add(message.datum_epoch)
      .Add(message.datum_counts)
      .Add(message.reference_lost)
      .Add(message.serial)
      .Add(message.firmware)
      .Add(message.nv_writes)
      .Take();
}

std::string StateKeyOf(const bus_health_t& message) {
  return StateKey().Add(message.boot_id).Add(message.state).Add(message.reopens).Add(message.last_error).Take();
}

std::string StateKeyOf(const recorder_health_t& message) {
  return StateKey().Add(message.boot_id).Add(message.state).Add(message.file).Add(message.last_error).Take();
}

std::string StateKeyOf(const motor_health_t& message) {
  return StateKey()
      .Add(message.boot_id)
      .Add(message.status_bits)
      .Add(message.trip_count)
      .Add(message.flags)
      .Add(message.stop_coil)
      .Add(message.logged_in)
      .Take();
}

std::string StateKeyOf(const time_quality_t& message) {
  return StateKey()
      .Add(message.boot_id)
      .Add(message.state)
      .Add(message.grade)
      .Add(message.source)
      .Add(message.base_id)
      .Add(message.epoch)
      .Add(message.flags)
      .Add(message.utc_grade)
      .Add(message.utc_source)
      .Take();
}

MachineFileRow MachineFileRowOf(Bytes data, std::int64_t utime) {
  MachineFileRow row{.text = CleanText(AsText(data)), .first_seen = utime};
  crypto_hash_sha256(row.sha256.data(), data.data(), data.size());
  return row;
}

}  // namespace axlecast
