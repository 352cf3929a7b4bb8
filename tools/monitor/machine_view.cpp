#include "tools/monitor/machine_view.h"

#include <algorithm>
#include <cmath>
#include <iterator>
#include <optional>
#include <utility>

#include "core/base/spelling.h"
#include "core/messages/enum_names.h"
#include "core/messages/message.h"

namespace axlecast {
namespace {

// `views` may be const.
template <typename Views>
auto* Find(Views& views, std::string_view name) {
  const auto found =
      std::find_if(views.begin(), views.end(), [name](const auto& view) { return view.name == name; });
  return found == views.end() ? nullptr : &*found;
}

bool OnPosition(DeviceView& device, Bytes message, MonoNs now) {
  const auto position = DecodeMessage<position_t>(message);
  if (!position) return false;
  device.readings.On(position->boot_id, position->seq);
  device.position = position;
  device.reading_at = now;
  if ((position->flags & position_t::FLAG_VALID) == 0) return true;
  device.valid = position;
  device.valid_at = now;
  ++device.valid_readings;
  return true;
}

bool OnMotor(DeviceView& device, Bytes message, MonoNs now) {
  const auto has = [](const motor_health_t& m, std::int32_t flag) { return (m.flags & flag) != 0; };
  const auto motor = DecodeMessage<motor_health_t>(message);
  if (!motor) return false;
  device.readings.On(motor->boot_id, motor->seq);
  device.motor = motor;
  device.reading_at = now;
  if (has(*motor, motor_health_t::FLAG_ANALOG_VALID) && has(*motor, motor_health_t::FLAG_STATUS_VALID)) {
    device.valid_at = now;
    ++device.valid_readings;
  }
  return true;
}

bool OnLimits(DeviceView& device, Bytes message, MonoNs now) {
  const auto limits = DecodeMessage<motor_limits_t>(message);
  if (!limits) return false;
  device.limits = limits;
  device.limits_at = now;
  return true;
}

// Returns true if the state or its cause has changed.
bool OnInfo(DeviceView& device, device_info_t info, MonoNs now) {
  const std::optional<device_info_t> before = std::exchange(device.info, std::move(info));
  device.info_at = now;
  device.was_online = device.was_online || device.info->state == device_info_t::STATE_ONLINE;
  return !before || before->state != device.info->state || before->reason != device.info->reason ||
         before->boot_id != device.info->boot_id || before->config_hash != device.info->config_hash;
}

// Compares the curves too: the unit restarts its trip numbers after its count was cleared.
bool SameTrip(const trip_log_t& one, const trip_log_t& other) {
  const auto same = [](float a, float b) { return a == b || (std::isnan(a) && std::isnan(b)); };
  for (std::size_t q = 0; q < std::size(one.samples); ++q) {
    if (!std::equal(std::begin(one.samples[q]), std::end(one.samples[q]), std::begin(other.samples[q]), same))
      return false;
  }
  return one.trip_count == other.trip_count && one.factor_bits == other.factor_bits &&
         one.valid_mask == other.valid_mask;
}

bool OnTrip(DeviceView& device, const trip_log_t& trip) {
  const auto same = [&trip](const trip_log_t& known) { return SameTrip(known, trip); };
  if (std::any_of(device.trips.begin(), device.trips.end(), same)) return false;
  if (device.trips.size() == DeviceView::kMaxTrips) device.trips.erase(device.trips.begin());
  device.trips.push_back(trip);
  return true;
}

std::string InBrackets(const std::string& reason) { return reason.empty() ? "" : " (" + reason + ")"; }

void AddDevice(const DeviceView& device, MonoNs now, std::vector<std::string>& faults) {
  if (!device.info && device.readings.received() == 0) {
    faults.push_back(device.name + ": no message of its driver was received");
  } else if (const auto state = device.State(now); state != device_info_t::STATE_ONLINE) {
    faults.push_back(device.name + ": " + (state ? std::string(DeviceStateName(*state)) : "SILENT") +
                     InBrackets(device.info ? device.info->reason : ""));
  }
}

void AddBus(const BusView& bus, MonoNs now, std::vector<std::string>& faults) {
  if (!bus.health) {
    faults.push_back(bus.name + ": the bus never reported");
  } else if (const auto state = bus.State(now); state != bus_health_t::STATE_UP) {
    faults.push_back(bus.name + ": " + (state ? std::string(BusStateName(*state)) : "SILENT") +
                     InBrackets(bus.health->last_error));
  }
}

}  // namespace

MachineView::MachineView(const MachineConfig& machine, Unlisted unlisted)
    : machine_(machine.machine), allows_unsigned_(machine.bridge.allow_unsigned), unlisted_(unlisted) {
  for (const BusConfig& bus : machine.buses) {
    buses_.emplace_back().name = bus.name;
    for (const DeviceConfig& device : bus.devices) {
      DeviceView& view = devices_.emplace_back();
      view.name = device.name;
      view.bus = bus.name;
      view.on_bus = buses_.size() - 1;
      view.has_position = bus.family == nullptr || bus.family->has_position;
    }
  }
  listed_devices_ = devices_.size();
  listed_buses_ = buses_.size();
  window_received_.assign(devices_.size(), 0);
}

MonitorUpdate MachineView::OnMessage(std::string_view channel, Bytes message, MonoNs now) {
  const std::size_t slash = channel.find('/');
  if (slash == std::string_view::npos) return {};
  const std::string_view kind = channel.substr(0, slash);
  const std::string_view name = channel.substr(slash + 1);
  if (kind == "BUS" || kind == "BUS_TIMES") return OnBus(kind, name, message, now);
  if (channel == "ALARM/bridge") {
    auto alarm = DecodeMessage<alarm_t>(message);
    if (!alarm) return {};
    return {.kind = MonitorUpdate::Kind::kBridgeAlarms, .changed = bridge_.On(std::move(*alarm), now)};
  }
  if (kind == "ALARM" && name.starts_with("mqtt/") && name.substr(5) == machine_) {
    if (auto alarm = DecodeMessage<alarm_t>(message)) broker_.On(std::move(*alarm), now);
    return {};
  }
  return OnDevice(kind, name, message, now);
}

MonitorUpdate MachineView::OnBus(std::string_view kind, std::string_view name, Bytes message, MonoNs now) {
  std::optional<bus_health_t> health;
  std::optional<exchange_times_t> times;
  if (kind == "BUS") {
    health = DecodeMessage<bus_health_t>(message);
  } else {
    times = DecodeMessage<exchange_times_t>(message);
  }
  BusView* bus = health || times ? BusOf(name) : nullptr;
  if (bus == nullptr) return {};
  const auto index = static_cast<std::size_t>(bus - buses_.data());
  if (times) {
    bus->times = std::move(times);
    bus->times_at = now;
    return {.kind = MonitorUpdate::Kind::kExchangeTimes, .index = index};
  }
  const bool news = !bus->health || bus->health->state != health->state;
  bus->health = std::move(health);
  bus->health_at = now;
  return {.kind = MonitorUpdate::Kind::kBus, .index = index, .changed = news};
}

MonitorUpdate MachineView::OnDevice(std::string_view kind, std::string_view name, Bytes message, MonoNs now) {
  // A device that the file does not list is known by its DEVICE alone, which names its bus.
  auto info = kind == "DEVICE" ? DecodeMessage<device_info_t>(message) : std::nullopt;
  DeviceView* device = info ? DeviceOf(name) : Find(devices_, name);
  if (device == nullptr) return {};
  MonitorUpdate update{.index = static_cast<std::size_t>(device - devices_.data())};
  if (info) {
    if (!device->listed) device->bus = IsName(info->bus) ? info->bus : "";
    update.kind = MonitorUpdate::Kind::kDevice;
    update.changed = OnInfo(*device, std::move(*info), now);
  } else if (kind == "POSITION" && device->has_position) {
    if (!OnPosition(*device, message, now)) return {};
    update.kind = MonitorUpdate::Kind::kPosition;
    FollowReading(*device, now);
  } else if (kind == "MOTOR" && (!device->has_position || (!device->listed && !device->position))) {
    if (!OnMotor(*device, message, now)) return {};
    device->has_position = false;
    update.kind = MonitorUpdate::Kind::kMotor;
    FollowReading(*device, now);
  } else if (kind == "LIMITS" && !device->has_position) {
    if (!OnLimits(*device, message, now)) return {};
    update.kind = MonitorUpdate::Kind::kMotorLimits;
  } else if (kind == "ALARM") {
    auto alarm = DecodeMessage<alarm_t>(message);
    if (!alarm) return {};
    update.kind = MonitorUpdate::Kind::kDeviceAlarms;
    update.changed = device->alarms.On(std::move(*alarm), now);
  } else if (kind == "TRIP") {
    const auto trip = DecodeMessage<trip_log_t>(message);
    if (!trip) return {};
    update.kind = MonitorUpdate::Kind::kTrip;
    update.changed = OnTrip(*device, *trip);
  }
  return update;
}

// A valid reading shows that its bus works and, where DEVICE did not come, that the device is online.
void MachineView::FollowReading(DeviceView& device, MonoNs now) {
  if (device.valid_at != now) return;
  if (device.on_bus) buses_[*device.on_bus].valid_at = now;
  device.was_online = device.was_online || device.Online(now);
}

DeviceView* MachineView::DeviceOf(std::string_view name) {
  DeviceView* known = Find(devices_, name);
  const bool room = devices_.size() - listed_devices_ < RoomFor(kMaxUnlistedDevices);
  if (known != nullptr || unlisted_ == Unlisted::kIgnored || !IsName(name)) return known;
  if (!room) {
    ++turned_away_;
    return nullptr;
  }
  DeviceView& device = devices_.emplace_back();
  device.name = name;
  device.listed = false;
  window_received_.push_back(0);
  return &device;
}

BusView* MachineView::BusOf(std::string_view name) {
  BusView* known = Find(buses_, name);
  const bool room = buses_.size() - listed_buses_ < RoomFor(kMaxUnlistedBuses);
  if (known != nullptr || unlisted_ == Unlisted::kIgnored || !IsName(name)) return known;
  if (!room) {
    ++turned_away_;
    return nullptr;
  }
  BusView& bus = buses_.emplace_back();
  bus.name = name;
  bus.listed = false;
  return &bus;
}

// If the machine file lists devices, only a few others are shown, enough to notice them.
std::size_t MachineView::RoomFor(std::size_t maximum) const {
  return listed_devices_ == 0 ? maximum : std::min(maximum, kMaxUnlisted);
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
                      [](const DeviceView& device) { return device.info || device.readings.received() > 0; }) &&
         std::none_of(buses_.begin(), buses_.end(), [](const BusView& bus) { return bus.health.has_value(); });
}

const DeviceView* MachineView::FindDevice(std::string_view name) const { return Find(devices_, name); }

std::vector<std::string> MachineFaults(const MachineView& machine, MonoNs now) {
  std::vector<std::string> faults;
  for (const DeviceView& device : machine.devices()) {
    if (device.listed) AddDevice(device, now, faults);
  }
  for (const BusView& bus : machine.buses()) {
    if (bus.listed) AddBus(bus, now, faults);
  }
  if (machine.bridge().Fresh(now)) {
    for (const alarm_entry_t& alarm : machine.bridge().entries()) {
      if (alarm.severity < alarm_entry_t::SEVERITY_ERROR) continue;
      faults.push_back("bridge: " + alarm.name + ": " + alarm.action);
    }
  }
  if (machine.broker().Fresh(now)) {
    for (const alarm_entry_t& alarm : machine.broker().entries()) {
      faults.push_back("mqtt: " + alarm.name + ": " + alarm.action);
    }
  }
  return faults;
}

}  // namespace axlecast
