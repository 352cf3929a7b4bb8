#include "tools/axlecast/machine_view.h"

#include <algorithm>
#include <axlecast/alarm_t.hpp>
#include <cmath>
#include <limits>
#include <numbers>

#include "drivers/runtime/core/decode_message.h"

namespace axlecast {
namespace {

constexpr double kUnknown = std::numeric_limits<double>::quiet_NaN();

constexpr std::size_t kAlarmsSeen = 100;  // anybody may publish names

bool Fresh(MonoNs at, MonoNs now) { return now - at <= kStaleAfter; }

// `views` may be const.
template <typename Views>
auto* Find(Views& views, std::string_view name) {
  const auto found =
      std::find_if(views.begin(), views.end(), [name](const auto& view) { return view.name == name; });
  return found == views.end() ? nullptr : &*found;
}

void OnPosition(DeviceView& device, Bytes message, MonoNs now) {
  const auto position = DecodeMessage<position_t>(message);
  if (!position) return;
  device.readings.On(position->boot_id, position->seq);
  device.position = position;
  device.reading_at = now;
  if ((position->flags & position_t::FLAG_VALID) == 0) return;
  device.valid = position;
  ++device.valid_readings;
}

void OnMotor(DeviceView& device, Bytes message, MonoNs now) {
  const auto has = [](const motor_health_t& m, std::int32_t flag) { return (m.flags & flag) != 0; };
  const auto motor = DecodeMessage<motor_health_t>(message);
  if (!motor) return;
  device.readings.On(motor->boot_id, motor->seq);
  device.motor = motor;
  device.reading_at = now;
  if (has(*motor, motor_health_t::FLAG_ANALOG_VALID) && has(*motor, motor_health_t::FLAG_STATUS_VALID)) {
    ++device.valid_readings;
  }
}

}  // namespace

std::optional<std::int8_t> DeviceView::State(MonoNs now) const {
  if (!info || !Fresh(info_at, now)) return std::nullopt;
  return info->state;
}

double DeviceView::Turns() const {
  if (!valid || valid->counts_per_turn <= 0) return kUnknown;
  return static_cast<double>(valid->counts) / static_cast<double>(valid->counts_per_turn);
}

double DeviceView::SpeedRpm() const {
  if (!position || (position->flags & position_t::FLAG_SPEED_VALID) == 0) return kUnknown;
  return position->speed_rad_s * 60 / (2 * std::numbers::pi);
}

bool DeviceView::Heard() const {
  if (!info || has_position || motor) return info.has_value();
  return info->state != device_info_t::STATE_ONLINE && info->state != device_info_t::STATE_DEGRADED;
}

std::optional<std::int8_t> BusView::State(MonoNs now) const {
  if (!health || !Fresh(health_at, now)) return std::nullopt;
  return health->state;
}

bool BridgeView::Serves(MonoNs now) const { return heard && Fresh(at, now); }

MachineView::MachineView(const MachineConfig& machine)
    : machine_(machine.machine), allows_unsigned_(machine.bridge.allow_unsigned) {
  for (const BusConfig& bus : machine.buses) {
    buses_.push_back({.name = bus.name, .health = std::nullopt});
    for (const DeviceConfig& device : bus.devices) {
      DeviceView& view = devices_.emplace_back();
      view.name = device.name;
      view.bus = bus.name;
      view.has_position = bus.family == nullptr || bus.family->has_position;
    }
  }
  window_received_.assign(devices_.size(), 0);
}

void MachineView::OnMessage(std::string_view channel, Bytes message, MonoNs now) {
  const std::size_t slash = channel.find('/');
  if (slash == std::string_view::npos) return;
  const std::string_view kind = channel.substr(0, slash);
  const std::string_view name = channel.substr(slash + 1);
  if (kind == "BUS") {
    BusView* bus = Find(buses_, name);
    if (bus == nullptr) return;
    if (auto health = DecodeMessage<bus_health_t>(message)) {
      bus->health = std::move(*health);
      bus->health_at = now;
    }
    return;
  }
  if (channel == "ALARM/bridge") return OnBridge(message, now);
  if (DeviceView* device = Find(devices_, name); device != nullptr) OnDevice(*device, kind, message, now);
}

void MachineView::OnBridge(Bytes message, MonoNs now) {
  auto alarm = DecodeMessage<alarm_t>(message);
  if (!alarm) return;
  bridge_.alarms = std::move(alarm->entries);
  bridge_.at = now;
  bridge_.heard = true;
}

void MachineView::OnDevice(DeviceView& device, std::string_view kind, Bytes message, MonoNs now) {
  if (kind == "POSITION" && device.has_position) {
    OnPosition(device, message, now);
  } else if (kind == "MOTOR" && !device.has_position) {
    OnMotor(device, message, now);
  } else if (kind == "DEVICE") {
    auto info = DecodeMessage<device_info_t>(message);
    if (!info) return;
    device.was_online = device.was_online || info->state == device_info_t::STATE_ONLINE;
    device.info = std::move(*info);
    device.info_at = now;
  } else if (kind == "ALARM") {
    auto alarm = DecodeMessage<alarm_t>(message);
    if (!alarm) return;
    device.alarms = std::move(alarm->entries);
    device.alarms_total = alarm->total;
    device.alarms_at = now;
    for (const alarm_entry_t& entry : device.alarms) {
      if (device.alarms_seen.size() < kAlarmsSeen) device.alarms_seen.insert(entry.name);
    }
  }
}

void MachineView::Tick(MonoNs now) {
  if (window_start_ == 0) window_start_ = now;
  const MonoNs window = now - window_start_;
  if (window < kSecond) return;
  for (std::size_t i = 0; i < devices_.size(); ++i) {
    const std::int64_t received = devices_[i].readings.received();
    devices_[i].reading_hz =
        static_cast<double>(received - window_received_[i]) * 1e9 / static_cast<double>(window);
    window_received_[i] = received;
  }
  window_start_ = now;
}

std::size_t MachineView::online(MonoNs now) const {
  return static_cast<std::size_t>(std::count_if(devices_.begin(), devices_.end(),
                                                [now](const DeviceView& device) { return device.Online(now); }));
}

bool MachineView::AllOnline(MonoNs now) const {
  return online(now) == devices_.size() &&
         std::all_of(buses_.begin(), buses_.end(), [now](const BusView& bus) { return bus.Up(now); });
}

bool MachineView::AllHeard() const {
  return std::all_of(devices_.begin(), devices_.end(), [](const DeviceView& device) { return device.Heard(); }) &&
         std::all_of(buses_.begin(), buses_.end(), [](const BusView& bus) { return bus.health.has_value(); });
}

bool MachineView::NoneHeard() const {
  return std::none_of(devices_.begin(), devices_.end(),
                      [](const DeviceView& device) { return device.info.has_value(); }) &&
         std::none_of(buses_.begin(), buses_.end(), [](const BusView& bus) { return bus.health.has_value(); });
}

const DeviceView* MachineView::FindDevice(std::string_view name) const { return Find(devices_, name); }

}  // namespace axlecast
