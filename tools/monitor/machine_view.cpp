#include "tools/monitor/machine_view.h"

#include <algorithm>
#include <cmath>
#include <iterator>
#include <limits>
#include <numbers>
#include <utility>

#include "core/base/spelling.h"
#include "core/messages/enum_names.h"
#include "core/messages/message.h"
#include "tools/monitor/time_agreement.h"

namespace axlecast {
namespace {

constexpr double kUnknown = std::numeric_limits<double>::quiet_NaN();

const alarm_entry_t* FindEntry(const std::vector<alarm_entry_t>& entries, const alarm_entry_t& like) {
  const auto found = std::ranges::find_if(entries, [&like](const alarm_entry_t& entry) {
    return entry.code == like.code && entry.source == like.source;
  });
  return found == entries.end() ? nullptr : &*found;
}

bool SameState(const alarm_entry_t& one, const alarm_entry_t& other) {
  return one.state == other.state && one.severity == other.severity && one.count == other.count &&
         one.name == other.name;
}

// `views` may be const.
template <typename Views>
auto* Find(Views& views, std::string_view name) {
  const auto found = std::ranges::find_if(views, [name](const auto& view) { return view.name == name; });
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
  if (std::ranges::any_of(device.trips, same)) return false;
  if (device.trips.size() == DeviceView::kMaxTrips) device.trips.erase(device.trips.begin());
  device.trips.push_back(trip);
  return true;
}

std::string InBrackets(const std::string& reason) { return reason.empty() ? "" : " (" + reason + ")"; }

void AddDevice(const DeviceView& device, MonoNs now, std::vector<std::string>& faults) {
  if (!device.info && device.readings.received() == 0) {
    faults.push_back(device.name + ": no message of its driver was received");
  } else if (!device.Online(now)) {
    faults.push_back(device.name + ": " + device.StateText(now) +
                     InBrackets(device.info ? device.info->reason : ""));
  }
}

void AddBus(const BusView& bus, MonoNs now, std::vector<std::string>& faults) {
  if (!bus.health) {
    faults.push_back(bus.name + ": the bus never reported");
  } else if (!bus.Up(now)) {
    faults.push_back(bus.name + ": " + bus.StateText(now) + InBrackets(bus.health->last_error));
  }
}

void AddSilentHosts(const MachineView& machine, MonoNs now, std::vector<std::string>& faults) {
  for (const HostConfig& host : machine.placement()) {
    if (!IsSilent(host, machine, now)) continue;
    faults.push_back("host " + host.name + ": nothing arrives from its buses (" + Listed(host.buses) +
                     "): does `axlecast up` or axlecast.target run there?");
  }
}

void AddHosts(const MachineView& machine, MonoNs now, std::vector<std::string>& faults) {
  if (machine.time_root().empty()) return;
  const HostView* root = Find(machine.hosts(), machine.time_root());
  if (root == nullptr || !root->State(now)) {
    faults.push_back("time base: the root " + machine.time_root() + " is silent: does `axlecast time` run there?");
  }
  for (const HostView& host : machine.hosts()) {
    if (host.Claims(now) || (&host == root && !host.State(now))) continue;
    faults.push_back("time base: host " + host.name + ": " + (host.State(now) ? host.quality.reason : "silent"));
  }
}

// Bridge, broker and time base.
void AddServices(const MachineView& machine, MonoNs now, std::vector<std::string>& faults) {
  if (machine.bridge().Fresh(now)) {
    for (const alarm_entry_t& alarm : machine.bridge().entries()) {
      if (alarm.severity < alarm_entry_t::SEVERITY_ERROR) continue;
      faults.push_back("bridge: " + alarm.name + ": " + alarm.action);
    }
  }
  const auto add_all = [&](const char* service, const AlarmView& alarms) {
    if (!alarms.Fresh(now)) return;
    for (const alarm_entry_t& alarm : alarms.entries()) {
      faults.push_back(std::string(service) + ": " + alarm.name + ": " + alarm.action);
    }
  };
  add_all("mqtt", machine.broker());
  add_all("ship", machine.shipper());
  AddHosts(machine, now, faults);
  for (std::string& fault : UtcFaults(machine, now)) faults.push_back(std::move(fault));
}

void AddNetwork(const MachineView& machine, std::vector<std::string>& faults) {
  const std::string& network = machine.reception().network;
  if (!network.empty()) faults.push_back("LCM: " + network);
}

}  // namespace

bool AlarmView::On(alarm_t message, MonoNs now) {
  const auto total = static_cast<std::size_t>(std::max<std::int16_t>(message.total, 0));
  bool changed = !received_ || total != total_;
  for (const alarm_entry_t& entry : message.entries) {
    const alarm_entry_t* before = FindEntry(entries_, entry);
    if (before == nullptr) Keep(message.utime, true, entry);
    changed = changed || before == nullptr || !SameState(*before, entry);
    if (seen_.size() < kMaxSeen) seen_.insert(entry.name);
  }
  // In a cut list, a missing alarm may only have been displaced by a worse one.
  const bool complete = total <= message.entries.size();
  for (const alarm_entry_t& before : entries_) {
    if (FindEntry(message.entries, before) != nullptr) continue;
    changed = true;
    if (complete) Keep(message.utime, false, before);
  }
  entries_ = std::move(message.entries);
  total_ = std::max(total, entries_.size());
  at_ = now;
  received_ = true;
  return changed;
}

void AlarmView::Keep(std::int64_t unix_us, bool appeared, const alarm_entry_t& entry) {
  changes_.push_back({unix_us, appeared, entry});
  if (changes_.size() > kMaxChanges) changes_.pop_front();
}

std::optional<std::int8_t> DeviceView::State(MonoNs now) const {
  if (info && now - info_at <= kStaleAfter) return info->state;
  if (valid_at && now - *valid_at <= kStaleAfter) {
    const bool degraded = info && info->state == device_info_t::STATE_DEGRADED;
    return degraded ? device_info_t::STATE_DEGRADED : device_info_t::STATE_ONLINE;
  }
  if (info && readings.received() > 0 && now - reading_at <= kStaleAfter) return info->state;
  return std::nullopt;
}

std::string DeviceView::StateText(MonoNs now) const {
  const auto state = State(now);
  return state ? std::string(DeviceStateName(*state)) : "SILENT";
}

double DeviceView::Turns() const {
  if (!valid || valid->counts_per_turn <= 0) return kUnknown;
  return static_cast<double>(valid->counts) / static_cast<double>(valid->counts_per_turn);
}

double DeviceView::SpeedRpm() const {
  if (!position || (position->flags & position_t::FLAG_SPEED_VALID) == 0) return kUnknown;
  return position->speed_rad_s * 60 / (2 * std::numbers::pi);
}

bool DeviceView::Received() const {
  if (!info || has_position || motor) return info.has_value();
  return info->state != device_info_t::STATE_ONLINE && info->state != device_info_t::STATE_DEGRADED;
}

std::optional<std::int8_t> HostView::State(MonoNs now) const {
  if (now - at > kStaleAfter) return std::nullopt;
  return quality.state;
}

const bus_health_t* BusView::FreshHealth(MonoNs now) const {
  return health && now - health_at <= kStaleAfter ? &*health : nullptr;
}

std::optional<std::int8_t> BusView::State(MonoNs now) const {
  if (const bus_health_t* fresh = FreshHealth(now)) return fresh->state;
  if (valid_at && now - *valid_at <= kStaleAfter) return bus_health_t::STATE_UP;
  return std::nullopt;
}

std::string BusView::StateText(MonoNs now) const {
  const auto state = State(now);
  return state ? std::string(BusStateName(*state)) : "SILENT";
}

MachineView::MachineView(const MachineConfig& machine, Unlisted unlisted)
    : machine_(machine.machine),
      allows_unsigned_(machine.bridge.allow_unsigned),
      unlisted_(unlisted),
      placement_(machine.hosts),
      time_root_(machine.time.root) {
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
  for (std::size_t i = 0; i < devices_.size(); ++i) device_index_.emplace(devices_[i].name, i);
  for (std::size_t i = 0; i < buses_.size(); ++i) bus_index_.emplace(buses_[i].name, i);
  listed_devices_ = devices_.size();
  listed_buses_ = buses_.size();
}

MonitorUpdate MachineView::OnMessage(std::string_view channel, Bytes message, MonoNs now) {
  const std::size_t slash = channel.find('/');
  if (slash == std::string_view::npos) return {};
  const std::string_view kind = channel.substr(0, slash);
  const std::string_view name = channel.substr(slash + 1);
  if (kind == "BUS" || kind == "BUS_TIMES") return OnBus(kind, name, message, now);
  if (kind == "TIME") return OnHostTime(name, message, now);
  if (channel == "ALARM/bridge") {
    auto alarm = DecodeMessage<alarm_t>(message);
    if (!alarm) return {};
    return {.kind = MonitorUpdate::Kind::kBridgeAlarms, .changed = bridge_.On(std::move(*alarm), now)};
  }
  for (const auto& [service, alarms] : {std::pair("mqtt/", &broker_), std::pair("ship/", &shipper_)}) {
    if (kind != "ALARM" || name != service + machine_) continue;
    if (auto alarm = DecodeMessage<alarm_t>(message)) alarms->On(std::move(*alarm), now);
    return {};
  }
  return OnDevice(kind, name, message, now);
}

template <typename View>
View* MachineView::FindOrAdd(std::vector<View>& views, Index& index, std::size_t listed, std::size_t maximum,
                             std::string_view name) {
  if (const auto known = index.find(name); known != index.end()) return &views[known->second];
  if (unlisted_ == Unlisted::kIgnored || !IsName(name)) return nullptr;
  // If the machine file lists devices, only a few others are shown, enough to notice them.
  if (views.size() - listed >= (listed_devices_ == 0 ? maximum : kMaxUnlisted)) {
    ++turned_away_;
    return nullptr;
  }
  ++layout_;
  index.emplace(name, views.size());
  View& view = views.emplace_back();
  view.name = name;
  view.listed = false;
  return &view;
}

MonitorUpdate MachineView::OnBus(std::string_view kind, std::string_view name, Bytes message, MonoNs now) {
  std::optional<bus_health_t> health;
  std::optional<exchange_times_t> times;
  if (kind == "BUS") {
    health = DecodeMessage<bus_health_t>(message);
  } else {
    times = DecodeMessage<exchange_times_t>(message);
  }
  BusView* bus = health || times ? FindOrAdd(buses_, bus_index_, listed_buses_, kMaxUnlistedBuses, name) : nullptr;
  if (bus == nullptr) return {};
  const auto index = static_cast<std::size_t>(bus - buses_.data());
  if (times) {
    bus->times = std::move(times);
    bus->times_at = now;
    return {.kind = MonitorUpdate::Kind::kExchangeTimes, .index = index};
  }
  const bool news = !bus->health || bus->health->state != health->state;
  if (!bus->listed && !bus->health) ++layout_;
  bus->health = std::move(health);
  bus->health_at = now;
  return {.kind = MonitorUpdate::Kind::kBus, .index = index, .changed = news};
}

MonitorUpdate MachineView::OnHostTime(std::string_view name, Bytes message, MonoNs now) {
  auto quality = DecodeMessage<time_quality_t>(message);
  if (!quality || !IsHostName(name)) return {};
  HostView* host = Find(hosts_, name);
  if (host == nullptr) {
    if (hosts_.size() == kMaxHosts) return {};
    host = &hosts_.emplace_back();
    host->name = name;
  }
  const bool news = host->at == 0 || host->quality.state != quality->state || host->quality.epoch != quality->epoch;
  host->quality = std::move(*quality);
  host->at = now;
  return {.kind = MonitorUpdate::Kind::kHostTime,
          .index = static_cast<std::size_t>(host - hosts_.data()),
          .changed = news};
}

MonitorUpdate MachineView::OnDevice(std::string_view kind, std::string_view name, Bytes message, MonoNs now) {
  // A device that the file does not list is known by its DEVICE alone, which names its bus.
  auto info = kind == "DEVICE" ? DecodeMessage<device_info_t>(message) : std::nullopt;
  DeviceView* device =
      info ? FindOrAdd(devices_, device_index_, listed_devices_, kMaxUnlistedDevices, name) : nullptr;
  if (const auto known = device_index_.find(name); !info && known != device_index_.end())
    device = &devices_[known->second];
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
    if (std::exchange(device->has_position, false)) ++layout_;
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

void MachineView::Tick(MonoNs now) {
  if (window_start_ == 0) window_start_ = now;
  const MonoNs window = now - window_start_;
  if (window < kSecond) return;
  window_received_.resize(devices_.size());
  for (std::size_t i = 0; i < devices_.size(); ++i) {
    const std::int64_t received = devices_[i].readings.received();
    devices_[i].reading_hz =
        static_cast<double>(received - window_received_[i]) * 1e9 / static_cast<double>(window);
    window_received_[i] = received;
  }
  window_start_ = now;
}

std::size_t MachineView::online(MonoNs now) const {
  return static_cast<std::size_t>(
      std::ranges::count_if(devices_, [now](const DeviceView& device) { return device.Online(now); }));
}

bool MachineView::AllOnline(MonoNs now) const {
  return online(now) == devices_.size() &&
         std::ranges::all_of(buses_, [now](const BusView& bus) { return bus.Up(now); });
}

bool MachineView::AllReceived() const {
  return (time_root_.empty() || !hosts_.empty()) &&
         std::ranges::all_of(devices_, [](const DeviceView& device) { return device.Received(); }) &&
         std::ranges::all_of(buses_, [](const BusView& bus) { return bus.health.has_value(); });
}

bool MachineView::NothingReceived() const {
  return std::ranges::none_of(
             devices_, [](const DeviceView& device) { return device.info || device.readings.received() > 0; }) &&
         std::ranges::none_of(buses_, [](const BusView& bus) { return bus.health.has_value(); });
}

const DeviceView* MachineView::FindDevice(std::string_view name) const {
  const auto found = device_index_.find(name);
  return found == device_index_.end() ? nullptr : &devices_[found->second];
}

const BusView* MachineView::FindBus(std::string_view name) const {
  const auto found = bus_index_.find(name);
  return found == bus_index_.end() ? nullptr : &buses_[found->second];
}

bool IsSilent(const HostConfig& host, const MachineView& machine, MonoNs now) {
  const auto silent = [&](const std::string& name) {
    const BusView* bus = machine.FindBus(name);
    return bus == nullptr || !bus->State(now);
  };
  return !host.buses.empty() && std::ranges::all_of(host.buses, silent);
}

std::vector<std::string> MachineFaults(const MachineView& machine, MonoNs now) {
  std::vector<std::string> faults;
  AddNetwork(machine, faults);
  AddSilentHosts(machine, now, faults);
  for (const DeviceView& device : machine.devices()) {
    if (device.listed) AddDevice(device, now, faults);
  }
  for (const BusView& bus : machine.buses()) {
    if (bus.listed) AddBus(bus, now, faults);
  }
  AddServices(machine, now, faults);
  return faults;
}

std::vector<std::string> CommonFaults(const MachineView& machine, MonoNs now) {
  std::vector<std::string> faults;
  AddNetwork(machine, faults);
  AddSilentHosts(machine, now, faults);
  AddServices(machine, now, faults);
  return faults;
}

}  // namespace axlecast
