#include "tools/axlecast/live/message_watch.h"

#include <algorithm>
#include <array>
#include <cstdio>
#include <limits>
#include <numbers>
#include <string_view>

#include "core/base/text.h"
#include "core/messages/enum_names.h"
#include "core/messages/json/field.h"
#include "core/messages/json/message_json.h"
#include "tools/axlecast/live/format_device.h"

namespace axlecast {
namespace {

using Json = nlohmann::ordered_json;

constexpr std::size_t kOthersKept = 100;
constexpr std::size_t kOthersNamed = 8;
constexpr std::size_t kRowWidth = 200;  // a wide terminal shows more

bool Matches(const std::regex& pattern, const std::string& channel) {
  try {
    return std::regex_search(channel, pattern);
  } catch (const std::regex_error&) {
    return false;  // too complex for this name
  }
}

// "1700000000.000001", as candump and tcpdump write time.
std::string Time(const Json& message) {
  const auto utime = message.at("utime").get<std::int64_t>();
  std::array<char, 48> text{};
  static_cast<void>(std::snprintf(text.data(), text.size(), "%lld.%06lld",
                                  static_cast<long long>(utime / 1'000'000),
                                  static_cast<long long>(utime % 1'000'000)));
  return text.data();
}

std::string Line(const std::string& channel, const std::string& type, const Json& message) {
  Json line;
  line["channel"] = channel;
  line["type"] = type;
  line.update(message);
  return JsonLine(line) + '\n';
}

double NumberOf(const Json& value) {
  return value.is_number() ? value.get<double>() : std::numeric_limits<double>::quiet_NaN();
}

double Number(const Json& message, const char* field) { return NumberOf(message.at(field)); }

std::int8_t Small(const Json& message, const char* field) { return message.at(field).get<std::int8_t>(); }

std::string Text(const Json& message, const char* field) { return message.at(field).get<std::string>(); }

std::string Errors(const Json& message) {
  std::int64_t errors[16] = {};
  const Json& list = message.at("errors");
  for (std::size_t kind = 0; kind < list.size() && kind < std::size(errors); ++kind) {
    errors[kind] = list[kind].get<std::int64_t>();
  }
  const std::string counts = ErrorCounts(errors);
  return counts.empty() ? "" : ", errors: " + counts;
}

std::string PositionText(const Json& message) {
  return Decimal(Number(message, "value"), 6) + ' ' + std::string(UnitName(Small(message, "unit"))) + ", turns " +
         Decimal(Number(message, "counts") / Number(message, "counts_per_turn"), 6) + ", rpm " +
         Decimal(Number(message, "speed_rad_s") * 60 / (2 * std::numbers::pi), 1) + ", " +
         FlagNames(message.at("flags").get<std::int32_t>());
}

std::string AlarmsText(const Json& message) {
  std::string text;
  for (const Json& entry : message.at("entries")) {
    text += (text.empty() ? "" : ", ") + Text(entry, "name") + " (" +
            std::string(SeverityName(Small(entry, "severity"))) + ", " +
            std::string(AlarmStateName(Small(entry, "state"))) + ")";
  }
  return text.empty() ? "no alarm" : text;
}

std::string DeviceText(const Json& message) {
  const std::string reason = Text(message, "reason");
  return std::string(DeviceStateName(Small(message, "state"))) + (reason.empty() ? "" : " (" + reason + ")") +
         ", " + Text(message, "family") + ' ' + Text(message, "model") + ", good " + message.at("good").dump() +
         Errors(message);
}

std::string BusText(const Json& message) {
  return std::string(BusStateName(Small(message, "state"))) + ", " + Decimal(Number(message, "rate_hz"), 1) +
         " of " + Decimal(Number(message, "wire_limit_hz"), 0) + " exchanges/s, good " + message.at("good").dump() +
         Errors(message);
}

std::string MotorText(const Json& message) {
  motor_health_t motor{};
  motor.voltage_v = static_cast<float>(Number(message, "voltage_v"));
  motor.current_a = static_cast<float>(Number(message, "current_a"));
  motor.power_w = static_cast<float>(Number(message, "power_w"));
  motor.temperature_c = static_cast<float>(Number(message, "temperature_c"));
  for (std::size_t axis = 0; axis < std::size(motor.accel_mps2); ++axis) {
    motor.accel_mps2[axis] = static_cast<float>(NumberOf(message.at("accel_mps2").at(axis)));
  }
  motor.status_bits = message.at("status_bits").get<std::int32_t>();
  motor.stop_coil = Small(message, "stop_coil");
  motor.logged_in = Small(message, "logged_in");
  motor.mains_hz = Small(message, "mains_hz");
  motor.flags = message.at("flags").get<std::int32_t>();
  return MotorQuantities(motor) + ", " + MotorStatusText(motor) + ", trips " + message.at("trip_count").dump();
}

std::string TripText(const Json& message) {
  const std::string cause = MotorStatusNames(message.at("factor_bits").get<std::int32_t>());
  return "trip " + message.at("trip_count").dump() + ", " + (cause.empty() ? "cause unknown" : cause) + ", log " +
         message.at("log_index").dump() + ", a sample each " + Decimal(Number(message, "interval_us") / 1e6, 1) +
         " s";
}

// Formats the trip limits. Limits that are 0 or unknown are omitted.
std::string LimitsText(const Json& message) {
  std::string text;
  const auto add = [&](const char* what, const Json& value, const char* unit, int decimals) {
    const double limit = NumberOf(value);
    if (!(limit > 0)) return;
    text += (text.empty() ? "trips at " : ", ") + std::string(what) + Decimal(limit, decimals) + unit;
  };
  constexpr std::array<const char*, 2> kAbove = {"power A above ", "power B above "};
  constexpr std::array<const char*, 2> kBelow = {"power A below ", "power B below "};
  for (std::size_t i = 0; i < kAbove.size(); ++i) add(kAbove[i], message.at("power_upper_w").at(i), " W", 1);
  for (std::size_t i = 0; i < kBelow.size(); ++i) add(kBelow[i], message.at("power_lower_w").at(i), " W", 1);
  add("", message.at("overheat_c"), " degC", 1);
  add("", message.at("shock_mps2"), " m/s2", 2);
  return text.empty() ? "no limit is known" : text;
}

// Any other message: its fields after the head, as JSON.
std::string FieldsText(const Json& message) {
  constexpr std::array<std::string_view, 5> kHead = {"utime", "mono_ns", "boot_id", "seq", "spare"};
  Json rest = Json::object();
  for (const auto& [name, value] : message.items()) {
    if (std::find(kHead.begin(), kHead.end(), name) == kHead.end()) rest[name] = value;
  }
  return JsonLine(rest);
}

}  // namespace

std::optional<std::string> MessageWatch::On(const std::string& channel, Bytes message) {
  if (!Matches(channel_, channel)) {
    if (shown_ == 0 && others_.size() < kOthersKept) others_.insert(channel);
    return std::nullopt;
  }
  std::string type;
  const std::optional<Json> json = DecodeToJson(message, &type);
  if (!json || !json->contains("seq")) {
    ++unknown_;
    return std::nullopt;
  }
  ++shown_;
  const std::string newest = json_ ? "" : Describe(type, *json);
  Count(channel, static_cast<std::int64_t>(std::stoull(json->at("boot_id").get<std::string>(), nullptr, 16)),
        json->at("seq").get<std::int64_t>(), newest);
  if (json_) return Line(channel, type, *json);
  return Time(*json) + ' ' + Printable(channel) + "  " + newest + '\n';
}

void MessageWatch::Count(const std::string& channel, std::int64_t boot_id, std::int64_t seq,
                         const std::string& newest) {
  auto seen = channels_.find(channel);
  if (seen == channels_.end()) {
    if (channels_.size() >= kMaxChannels) {
      ++uncounted_;
      return;
    }
    seen = channels_.try_emplace(channel).first;
  }
  seen->second.sequence.On(boot_id, seq);
  seen->second.newest = newest;
}

std::vector<std::string> MessageWatch::Table(MonoNs now) {
  const MonoNs window = now - window_;
  std::vector<std::string> lines = {"CHANNEL                           /s  NEWEST"};
  for (auto& [channel, seen] : channels_) {
    if (window >= kSecond) {
      const std::int64_t received = seen.sequence.received();
      if (window_ != 0)
        seen.hz = static_cast<double>(received - seen.at_window) * 1e9 / static_cast<double>(window);
      seen.at_window = received;
    }
    lines.push_back(
        Clip(Left(Printable(channel), 28) + ' ' + Right(Decimal(seen.hz, 1), 8) + "  " + seen.newest, kRowWidth));
  }
  if (window >= kSecond) window_ = now;
  return lines;
}

std::string MessageWatch::OtherChannels() const {
  std::string text;
  std::size_t named = 0;
  for (const std::string& channel : others_) {
    if (named == kOthersNamed) return text + " and more";
    text += (named++ == 0 ? "" : ", ") + Printable(channel);
  }
  return text;
}

std::vector<std::string> MessageWatch::Losses() const {
  std::vector<std::string> lines;
  for (const auto& [channel, seen] : channels_) {
    if (seen.sequence.lost() == 0) continue;
    lines.push_back(Printable(channel) + ": " + std::to_string(seen.sequence.lost()) + " of " +
                    std::to_string(seen.sequence.lost() + seen.sequence.received()) +
                    " messages lost on the way here");
  }
  if (uncounted_ > 0) {
    lines.push_back(std::to_string(uncounted_) + " messages were of channels beyond the first " +
                    std::to_string(kMaxChannels) + ": their losses were not counted");
  }
  if (unknown_ > 0) lines.push_back(std::to_string(unknown_) + " messages that are not axlecast's were not shown");
  return lines;
}

std::string Describe(const std::string& type, const Json& message) {
  if (type == "position_t") return PositionText(message);
  if (type == "alarm_t") return Printable(AlarmsText(message));
  if (type == "device_info_t") return Printable(DeviceText(message));
  if (type == "bus_health_t") return Printable(BusText(message));
  if (type == "motor_health_t") return MotorText(message);
  if (type == "trip_log_t") return TripText(message);
  if (type == "motor_limits_t") return LimitsText(message);
  return Printable(FieldsText(message));
}

}  // namespace axlecast
