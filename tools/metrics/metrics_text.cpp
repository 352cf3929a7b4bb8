#include "tools/metrics/metrics_text.h"

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <limits>
#include <numbers>
#include <optional>
#include <span>

#include "core/base/text.h"
#include "core/device/reading.h"
#include "core/messages/enum_names.h"
#include "tools/monitor/time_agreement.h"

namespace axlecast {
namespace {

std::string_view TypeName(Exposition::Type type) {
  static constexpr std::array<std::string_view, 3> kNames = {"counter", "gauge", "histogram"};
  return kNames.at(static_cast<std::size_t>(type));
}

std::string Escaped(std::string_view value) {
  std::string text;
  for (const char c : TerminalText(MendedUtf8(value))) {
    if (c == '\n') {
      text += "\\n";
      continue;
    }
    if (c == '\\' || c == '"') text += '\\';
    text += c;
  }
  return text;
}

}  // namespace

std::string MetricNumber(double value) {
  if (std::isnan(value)) return "NaN";
  if (std::isinf(value)) return value > 0 ? "+Inf" : "-Inf";
  std::array<char, 32> digits{};
  const auto end = std::to_chars(digits.data(), digits.data() + digits.size(), value).ptr;
  return {digits.data(), end};
}

void Exposition::Family(std::string_view name, Type type, std::string_view help) {
  name_ = name;
  samples_.clear();
  header_ =
      "# HELP " + name_ + ' ' + std::string(help) + "\n# TYPE " + name_ + ' ' + std::string(TypeName(type)) + '\n';
}

void Exposition::Add(std::string_view suffix, Labels labels, double value) {
  AddText(suffix, labels, MetricNumber(value));
}

void Exposition::Add(std::string_view suffix, Labels labels, std::int64_t value) {
  AddText(suffix, labels, std::to_string(value));
}

void Exposition::AddText(std::string_view suffix, Labels labels, std::string_view value) {
  std::string sample = name_ + std::string(suffix);
  char before = '{';
  for (const auto& [label, text] : labels) {
    sample += before + std::string(label) + "=\"" + Escaped(text) + '"';
    before = ',';
  }
  if (labels.size() > 0) sample += '}';
  if (!samples_.insert(sample).second) return;
  text_ += std::exchange(header_, "");
  text_ += sample + ' ' + std::string(value) + '\n';
}

namespace {

using Type = Exposition::Type;
using Names = std::span<const std::string_view>;

// Returns the last report of a sender that the machine's file lists, or null.
const device_info_t* ReportOf(const DeviceView& device) {
  return device.listed && device.info ? &*device.info : nullptr;
}
const bus_health_t* ReportOf(const BusView& bus) { return bus.listed && bus.health ? &*bus.health : nullptr; }
const recorder_health_t* ReportOf(const RecorderView& recorder) {
  return recorder.listed && recorder.health ? &*recorder.health : nullptr;
}

// A family with one number of each report.
template <typename Report>
struct ReportedNumber {
  std::string_view name;
  Type type;
  std::string_view help;
  std::int64_t (*value)(const Report& report);
};

template <typename Views, typename Report, std::size_t N>
void AddReported(Exposition& out, std::string_view label, const Views& views,
                 const ReportedNumber<Report> (&numbers)[N]) {
  for (const ReportedNumber<Report>& number : numbers) {
    out.Family(number.name, number.type, number.help);
    for (const auto& view : views) {
      if (const Report* report = ReportOf(view)) out.Add({{label, view.name}}, number.value(*report));
    }
  }
}

// Adds a family with the momentary values of the listed senders. NaN: the sender has no value now.
template <typename Views, typename Value>
void AddMomentary(Exposition& out, std::string_view name, Type type, std::string_view help, std::string_view label,
                  const Views& views, const Value& value) {
  out.Family(name, type, help);
  for (const auto& view : views) {
    const double number = view.listed ? static_cast<double>(value(view)) : NAN;
    if (!std::isnan(number)) out.Add({{label, view.name}}, number);
  }
}

template <typename Views>
void AddErrors(Exposition& out, std::string_view name, std::string_view help, std::string_view label,
               const Views& views) {
  out.Family(name, Type::kCounter, help);
  for (const auto& view : views) {
    const auto* report = ReportOf(view);
    for (std::size_t kind = 0; report != nullptr && kind < kErrorKinds; ++kind) {
      out.Add({{label, view.name}, {"kind", ErrorName(static_cast<ErrorKind>(kind))}}, report->errors[kind]);
    }
  }
}

// Adds a state in the form of Prometheus: one sample for each of `names`, 1 for the current state, else 0. The last name is
// used if the state is unknown or no longer reported.
void AddState(Exposition& out, std::string_view label, std::string_view sender, Names names,
              std::optional<std::int8_t> state) {
  const std::size_t last = names.size() - 1;
  const bool known = state && *state >= 0 && static_cast<std::size_t>(*state) < last;
  const std::size_t present = known ? static_cast<std::size_t>(*state) : last;
  for (std::size_t i = 0; i <= last; ++i) {
    out.Add({{label, sender}, {"state", names[i]}}, std::int64_t{i == present});
  }
}

// ---- devices ----

// device_info_t STATE_*, and "silent" without messages of its driver.
constexpr std::array<std::string_view, 5> kDeviceStates = {"starting", "online", "degraded", "offline", "silent"};

// Returns true if the newest reading is still current.
bool Answers(const DeviceView& device, MonoNs now) {
  const auto state = device.State(now);
  return state == device_info_t::STATE_ONLINE || state == device_info_t::STATE_DEGRADED;
}

void AddPositions(Exposition& out, const MachineView& machine, MonoNs now) {
  const auto add = [&](std::string_view name, std::string_view help, const auto& value) {
    AddMomentary(out, name, Type::kGauge, help, "device", machine.devices(), [&](const DeviceView& device) {
      return device.position && Answers(device, now) ? value(device) : NAN;
    });
  };
  const auto flag = [](std::int32_t bit) {
    return [bit](const DeviceView& device) { return (device.position->flags & bit) != 0 ? 1.0 : 0.0; };
  };
  add("axlecast_device_position_valid", "1 while the newest position may be used, else 0.",
      flag(position_t::FLAG_VALID));
  add("axlecast_device_referenced", "1 while a datum is set and nothing has put it in doubt, else 0.",
      flag(position_t::FLAG_REFERENCED));
  add("axlecast_device_position_radians",
      "Angle of the shaft with its whole turns, after direction and datum, of the newest valid position.",
      [](const DeviceView& device) { return device.Turns() * 2 * std::numbers::pi; });
  add("axlecast_device_speed_radians_per_second", "Speed of the shaft, after direction.",
      [](const DeviceView& device) { return device.SpeedRpm() * 2 * std::numbers::pi / 60; });
}

void AddDevices(Exposition& out, const MachineView& machine, MonoNs now) {
  out.Family("axlecast_device_info", Type::kGauge, "Identity of a device; always 1.");
  for (const DeviceView& device : machine.devices()) {
    const device_info_t* info = ReportOf(device);
    if (info == nullptr) continue;
    out.Add({{"device", device.name},
             {"bus", device.bus},
             {"family", info->family},
             {"model", info->model},
             {"serial", info->serial},
             {"firmware", info->firmware}},
            std::int64_t{1});
  }
  out.Family("axlecast_device_state", Type::kGauge,
             "1 for the state the device is in, else 0; silent: its driver does not report.");
  for (const DeviceView& device : machine.devices()) {
    if (device.listed) AddState(out, "device", device.name, kDeviceStates, device.State(now));
  }
  static constexpr ReportedNumber<device_info_t> kNumbers[] = {
      {"axlecast_device_readings_total", Type::kCounter, "Good readings since the driver started.",
       [](const device_info_t& info) { return info.good; }},
      {"axlecast_device_nonvolatile_writes_total", Type::kCounter,
       "Writes to the device's memory of limited endurance by this driver process.",
       [](const device_info_t& info) { return std::int64_t{info.nv_writes}; }},
      {"axlecast_device_reference_lost", Type::kGauge,
       "1 from an event that put the reference in doubt until a datum or a reset of turns, else 0.",
       [](const device_info_t& info) { return std::int64_t{info.reference_lost != 0}; }}};
  AddReported(out, "device", machine.devices(), kNumbers);
  AddErrors(out, "axlecast_device_reading_errors_total", "Readings that failed since the driver started, by kind.",
            "device", machine.devices());
  AddMomentary(out, "axlecast_device_last_good_timestamp_seconds", Type::kGauge,
               "UNIX time of the last good reading; 0 before the first.", "device", machine.devices(),
               [](const DeviceView& device) {
                 return device.info ? static_cast<double>(device.info->last_good_utime) / 1e6 : NAN;
               });
  AddPositions(out, machine, now);
}

// Adds readings of motor monitors, while they answer.
void AddMotors(Exposition& out, const MachineView& machine, MonoNs now) {
  // Returns the motor if its readings with `flag` are current, else null.
  const auto motor_of = [now](const DeviceView& device, std::int32_t flag) {
    const bool current = device.listed && device.motor && Answers(device, now) && (device.motor->flags & flag) != 0;
    return current ? &*device.motor : nullptr;
  };
  const auto add = [&](std::int32_t flag, std::string_view name, Type type, std::string_view help,
                       double (*value)(const motor_health_t&)) {
    AddMomentary(out, name, type, help, "device", machine.devices(), [&](const DeviceView& device) {
      const motor_health_t* motor = motor_of(device, flag);
      return motor == nullptr ? NAN : value(*motor);
    });
  };
  constexpr std::int32_t kAnalog = motor_health_t::FLAG_ANALOG_VALID;
  constexpr std::int32_t kStatus = motor_health_t::FLAG_STATUS_VALID;
  add(kAnalog, "axlecast_motor_voltage_volts", Type::kGauge, "Voltage.",
      [](const motor_health_t& motor) -> double { return motor.voltage_v; });
  add(kAnalog, "axlecast_motor_current_amperes", Type::kGauge, "Current.",
      [](const motor_health_t& motor) -> double { return motor.current_a; });
  add(kAnalog, "axlecast_motor_power_watts", Type::kGauge, "Power.",
      [](const motor_health_t& motor) -> double { return motor.power_w; });
  add(kAnalog, "axlecast_motor_temperature_celsius", Type::kGauge, "Temperature.",
      [](const motor_health_t& motor) -> double { return motor.temperature_c; });
  static constexpr std::array<std::string_view, 3> kAxes = {"x", "y", "z"};
  out.Family("axlecast_motor_acceleration_meters_per_second_squared", Type::kGauge,
             "Instantaneous acceleration by axis of the unit; no vibration analysis.");
  for (const DeviceView& device : machine.devices()) {
    const motor_health_t* motor = motor_of(device, kAnalog);
    for (std::size_t axis = 0; motor != nullptr && axis < kAxes.size(); ++axis) {
      const double value = motor->accel_mps2[axis];
      if (!std::isnan(value)) out.Add({{"device", device.name}, {"axis", kAxes[axis]}}, value);
    }
  }
  add(kStatus, "axlecast_motor_trips_total", Type::kCounter, "Trips since the unit's count was cleared.",
      [](const motor_health_t& motor) -> double { return motor.trip_count; });
  add(kStatus, "axlecast_motor_tripped", Type::kGauge, "1 while the unit reports that it has tripped, else 0.",
      [](const motor_health_t& motor) { return (motor.flags & motor_health_t::FLAG_TRIPPED) != 0 ? 1.0 : 0.0; });
  add(kStatus, "axlecast_motor_stop_commanded", Type::kGauge, "1 while the stop coil is set, else 0.",
      [](const motor_health_t& motor) -> double { return motor.stop_coil < 0 ? NAN : motor.stop_coil; });
}

// ---- buses ----

// bus_health_t STATE_*, and "silent" without messages of its driver.
constexpr std::array<std::string_view, 5> kBusStates = {"starting", "up", "degraded", "down", "silent"};

constexpr ReportedNumber<bus_health_t> kBusCounters[] = {
    {"axlecast_bus_exchanges_total", Type::kCounter, "Exchanges of all kinds since the driver started.",
     [](const bus_health_t& bus) { return bus.exchanges; }},
    {"axlecast_bus_readings_total", Type::kCounter, "Good readings of the bus's devices.",
     [](const bus_health_t& bus) { return bus.good; }},
    {"axlecast_bus_late_slots_total", Type::kCounter, "Poll slots that were missed.",
     [](const bus_health_t& bus) { return bus.late; }},
    {"axlecast_bus_receive_dropped_total", Type::kCounter,
     "Characters or frames that were received and lost by the kernel or the adapter.",
     [](const bus_health_t& bus) { return bus.rx_dropped; }},
    {"axlecast_bus_reopens_total", Type::kCounter, "Times the line was opened again.",
     [](const bus_health_t& bus) { return std::int64_t{bus.reopens}; }}};

void AddRates(Exposition& out, const MachineView& machine, MonoNs now) {
  const auto add = [&](std::string_view name, std::string_view help, double (*value)(const bus_health_t&)) {
    AddMomentary(out, name, Type::kGauge, help, "bus", machine.buses(), [&](const BusView& bus) {
      const bus_health_t* health = bus.FreshHealth(now);
      return health == nullptr ? NAN : value(*health);
    });
  };
  add("axlecast_bus_exchange_rate_hertz", "Exchanges a second over the last second.",
      [](const bus_health_t& bus) -> double { return bus.rate_hz; });
  add("axlecast_bus_wire_limit_hertz",
      "Readings a second that the wire's timing allows; absent where it is not known.",
      [](const bus_health_t& bus) -> double { return bus.wire_limit_hz > 0 ? bus.wire_limit_hz : NAN; });
  add("axlecast_bus_utilisation_ratio", "Share of the wire's limit in use, 0 to 1.",
      [](const bus_health_t& bus) -> double { return bus.wire_limit_hz > 0 ? bus.utilisation : NAN; });
  add("axlecast_bus_can_transmit_errors", "The CAN controller's transmit error counter.",
      [](const bus_health_t& bus) -> double { return bus.can_tec < 0 ? NAN : bus.can_tec; });
  add("axlecast_bus_can_receive_errors", "The CAN controller's receive error counter.",
      [](const bus_health_t& bus) -> double { return bus.can_rec < 0 ? NAN : bus.can_rec; });
}

// Anybody may send anything: a histogram that falls would void the whole text.
bool MakesSense(const exchange_times_t& times) {
  return !times.bound_us.empty() && times.within.size() == times.bound_us.size() && times.bound_us.front() > 0 &&
         std::ranges::is_sorted(times.bound_us, std::ranges::less_equal()) &&
         std::ranges::is_sorted(times.within) && times.within.front() >= 0 && times.within.back() <= times.total &&
         times.sum_us >= 0;
}

void AddTimes(Exposition& out, const MachineView& machine) {
  out.Family("axlecast_bus_exchange_seconds", Type::kHistogram,
             "How long answered exchanges took, from before the write to after the last read.");
  for (const BusView& bus : machine.buses()) {
    if (!bus.listed || !bus.times || !MakesSense(*bus.times)) continue;
    const exchange_times_t& times = *bus.times;
    for (std::size_t i = 0; i < times.bound_us.size(); ++i) {
      out.Add("_bucket", {{"bus", bus.name}, {"le", MetricNumber(times.bound_us[i] / 1e6)}}, times.within[i]);
    }
    out.Add("_bucket", {{"bus", bus.name}, {"le", "+Inf"}}, times.total);
    out.Add("_sum", {{"bus", bus.name}}, static_cast<double>(times.sum_us) / 1e6);
    out.Add("_count", {{"bus", bus.name}}, times.total);
  }
}

void AddBuses(Exposition& out, const MachineView& machine, MonoNs now) {
  out.Family("axlecast_bus_info", Type::kGauge, "What a bus is; always 1.");
  for (const BusView& bus : machine.buses()) {
    const bus_health_t* health = ReportOf(bus);
    if (health == nullptr) continue;
    out.Add({{"bus", bus.name}, {"family", health->family}, {"port", health->port}}, std::int64_t{1});
  }
  out.Family("axlecast_bus_state", Type::kGauge,
             "1 for the state the bus is in, else 0; silent: its driver does not report.");
  for (const BusView& bus : machine.buses()) {
    if (bus.listed) AddState(out, "bus", bus.name, kBusStates, bus.State(now));
  }
  AddReported(out, "bus", machine.buses(), kBusCounters);
  AddErrors(out, "axlecast_bus_errors_total",
            "What failed, by kind: readings of its devices, damaged characters (framing), losses of the line (io).",
            "bus", machine.buses());
  AddRates(out, machine, now);
  AddTimes(out, machine);
}

// ---- alarms, recorders, commands, messages ----

// recorder_health_t STATE_*, and for a recorder that ended or does not report.
constexpr std::array<std::string_view, 7> kRecorderStates = {"recording", "pre_trigger", "disk_full", "error",
                                                             "stopping",  "ended",       "silent"};
constexpr std::int8_t kRecorderEnded = 5;

// command_status_t STATE_*, of those that are final.
struct Outcome {
  std::int8_t state;
  std::string_view name;
};
constexpr std::array<Outcome, 6> kOutcomes = {{{command_status_t::STATE_SUCCEEDED, "succeeded"},
                                               {command_status_t::STATE_REJECTED, "rejected"},
                                               {command_status_t::STATE_FAILED, "failed"},
                                               {command_status_t::STATE_EXPIRED, "expired"},
                                               {command_status_t::STATE_CANCELLED, "cancelled"},
                                               {command_status_t::STATE_INDETERMINATE, "indeterminate"}}};

// Calls use(origin, name, alarms) for every listed sender. `origin` is device, bridge or recorder.
template <typename Use>
void EachSender(const Monitor& monitor, Use use) {
  for (const DeviceView& device : monitor.machine().devices()) {
    if (device.listed) use("device", device.name, device.alarms);
  }
  use("bridge", "bridge", monitor.machine().bridge());
  for (const RecorderView& recorder : monitor.recorders()) {
    if (recorder.listed) use("recorder", recorder.name, recorder.alarms);
  }
}

void AddAlarms(Exposition& out, const Monitor& monitor) {
  out.Family("axlecast_alarm", Type::kGauge,
             "An active alarm, as last reported by its sender; always 1. At most the eight worst of each sender.");
  EachSender(monitor, [&out](std::string_view origin, std::string_view name, const AlarmView& alarms) {
    for (const alarm_entry_t& entry : alarms.entries()) {
      out.Add({{"origin", origin},
               {"name", name},
               {"alarm", entry.name},
               {"severity", SeverityName(entry.severity)},
               {"state", AlarmStateName(entry.state)}},
              std::int64_t{1});
    }
  });
  out.Family("axlecast_alarms", Type::kGauge, "Active alarms, including those beyond the eight worst.");
  EachSender(monitor, [&out](std::string_view origin, std::string_view name, const AlarmView& alarms) {
    if (alarms.received()) out.Add({{"origin", origin}, {"name", name}}, static_cast<std::int64_t>(alarms.total()));
  });
}

constexpr ReportedNumber<recorder_health_t> kRecorderNumbers[] = {
    {"axlecast_recorder_messages_total", Type::kCounter, "Messages recorded since the recorder started.",
     [](const recorder_health_t& health) { return health.messages; }},
    {"axlecast_recorder_written_bytes_total", Type::kCounter, "Bytes written since the recorder started.",
     [](const recorder_health_t& health) { return health.total_bytes; }},
    {"axlecast_recorder_lost_messages_total", Type::kCounter,
     "Messages that are missing from the log, over all senders.",
     [](const recorder_health_t& health) { return health.lost; }},
    {"axlecast_recorder_kernel_dropped_datagrams_total", Type::kCounter,
     "Datagrams that the kernel dropped at the recorder's socket.",
     [](const recorder_health_t& health) { return health.kernel_dropped; }},
    {"axlecast_recorder_file_bytes", Type::kGauge, "Size of the file being written.",
     [](const recorder_health_t& health) { return health.file_bytes; }},
    {"axlecast_recorder_free_bytes", Type::kGauge, "Free space on the recorder's disk.",
     [](const recorder_health_t& health) { return health.free_bytes; }}};

void AddRecorders(Exposition& out, const Monitor& monitor, MonoNs now) {
  out.Family("axlecast_recorder_state", Type::kGauge,
             "1 for the state the recorder is in, else 0; ended: it was stopped; silent: it does not report.");
  for (const RecorderView& recorder : monitor.recorders()) {
    if (!recorder.listed) continue;
    const auto state = recorder.Ended(now) ? kRecorderEnded : recorder.State(now);
    AddState(out, "recorder", recorder.name, kRecorderStates, state);
  }
  AddReported(out, "recorder", monitor.recorders(), kRecorderNumbers);
}

// Only of a machine whose file has a time base. MachineView bounds the number of hosts.
void AddHosts(Exposition& out, const MachineView& machine, MonoNs now) {
  if (machine.time_root().empty()) return;
  out.Family("axlecast_time_claim", Type::kGauge, "1 while the host claims an interval of the time base; else 0.");
  for (const HostView& host : machine.hosts()) out.Add({{"host", host.name}}, std::int64_t{host.Claims(now)});
  out.Family("axlecast_time_half_width_seconds", Type::kGauge,
             "Half width of the claimed interval; NaN without a claim.");
  for (const HostView& host : machine.hosts()) {
    const double half_width = static_cast<double>(host.quality.half_width_ns) * 1e-9;
    out.Add({{"host", host.name}}, host.Claims(now) ? half_width : std::numeric_limits<double>::quiet_NaN());
  }
  out.Family("axlecast_utc_half_width_seconds", Type::kGauge,
             "Half width of what the daemon that keeps UNIX time claims about UTC; NaN without a claim.");
  for (const HostView& host : machine.hosts()) {
    const bool claims = host.State(now) && host.quality.utc_half_width_ns >= 0;
    const double half_width = static_cast<double>(host.quality.utc_half_width_ns) * 1e-9;
    out.Add({{"host", host.name}}, claims ? half_width : std::numeric_limits<double>::quiet_NaN());
  }
  out.Family(
      "axlecast_unix_clock_ahead_seconds", Type::kGauge,
      "How far UNIX time of the host is ahead of that of the root of the time base; NaN if it is not known.");
  for (const HostView& host : machine.hosts()) {
    const auto ahead = DifferenceToRoot(machine, host, now);
    out.Add({{"host", host.name}},
            ahead ? static_cast<double>(ahead->ns) * 1e-9 : std::numeric_limits<double>::quiet_NaN());
  }
  out.Family("axlecast_time_epochs_total", Type::kCounter,
             "Times that the clock of the host or its base broke since its service started.");
  for (const HostView& host : machine.hosts()) out.Add({{"host", host.name}}, std::int64_t{host.quality.epoch});
}

void AddCommands(Exposition& out, const Monitor& monitor) {
  out.Family("axlecast_commands_total", Type::kCounter, "Commands whose outcome was received, by outcome.");
  for (const Outcome& outcome : kOutcomes) {
    out.Add({{"outcome", outcome.name}}, monitor.commands().outcomes(outcome.state));
  }
}

template <typename Views>
std::int64_t CountUnlisted(const Views& views) {
  return std::count_if(views.begin(), views.end(), [](const auto& view) { return !view.listed; });
}

// Returns false for channels of devices, buses and recorders that are not in the machine file: anybody can invent names.
bool HasSeries(const Monitor& monitor, std::string_view channel) {
  const std::string_view name = channel.substr(channel.rfind('/') + 1);
  const auto is_unlisted = [name](const auto& view) { return !view.listed && view.name == name; };
  if (channel.starts_with("BUS/") || channel.starts_with("BUS_TIMES/"))
    return std::ranges::none_of(monitor.machine().buses(), is_unlisted);
  if (channel.starts_with("TIME/")) return false;  // of no host in the machine file but the root
  if (channel.starts_with("RECORDER/") || channel.starts_with("ALARM/recorder/"))
    return std::ranges::none_of(monitor.recorders(), is_unlisted);
  return std::ranges::none_of(monitor.machine().devices(), is_unlisted);
}

void AddChannels(Exposition& out, const Monitor& monitor, std::int64_t (SequenceCount::*value)() const) {
  for (const auto& [channel, count] : monitor.channels()) {
    if (HasSeries(monitor, channel)) out.Add({{"channel", channel}}, (count.*value)());
  }
}

void AddReception(Exposition& out, const Monitor& monitor) {
  out.Family("axlecast_messages_received_total", Type::kCounter,
             "Messages that this process received, by channel.");
  AddChannels(out, monitor, &SequenceCount::received);
  out.Family("axlecast_messages_lost_total", Type::kCounter,
             "Messages that did not reach this process, by the gaps in their sequence numbers.");
  AddChannels(out, monitor, &SequenceCount::lost);
  out.Family("axlecast_messages_unusable_total", Type::kCounter,
             "Messages that were malformed or of no device, bus or recorder that there was room for.");
  out.Add({}, monitor.passed_over());
  out.Family("axlecast_unlisted_senders", Type::kGauge,
             "Devices, buses and recorders that are received and not in the machine's file; they have no series of "
             "their own.");
  out.Add({{"kind", "device"}}, CountUnlisted(monitor.machine().devices()));
  out.Add({{"kind", "bus"}}, CountUnlisted(monitor.machine().buses()));
  out.Add({{"kind", "recorder"}}, CountUnlisted(monitor.recorders()));
  const ReceptionCounts& reception = monitor.machine().reception();
  out.Family(
      "axlecast_lcm_network_usable", Type::kGauge,
      "1 if this process receives by the interface of the machine's file, 0 if the interface is missing or down.");
  out.Add({}, std::int64_t{reception.network.empty()});
  out.Family("axlecast_kernel_dropped_datagrams_total", Type::kCounter,
             "Datagrams that the kernel dropped because this process's receive buffer was full.");
  out.Add({}, reception.dropped);
  out.Family("axlecast_refused_datagrams_total", Type::kCounter,
             "Datagrams that this process refused: of other hosts although the URL has ttl=0, or not made by LCM.");
  out.Add({{"cause", "other_host"}}, reception.outside);
  out.Add({{"cause", "malformed"}}, reception.malformed);
  out.Family("axlecast_other_machine_messages_total", Type::kCounter,
             "Messages of another machine on the same LCM group and port, which this process refused.");
  for (const OtherMachine& machine : reception.machines) out.Add({{"machine", machine.name}}, machine.messages);
}

}  // namespace

std::string MetricsText(const Monitor& monitor, MonoNs now, std::string_view version) {
  Exposition out;
  out.Family("axlecast_build_info", Type::kGauge, "The version of axlecast that exports these metrics; always 1.");
  out.Add({{"version", version}}, std::int64_t{1});
  out.Family("axlecast_machine_info", Type::kGauge, "The machine of the file; always 1.");
  out.Add({{"machine", monitor.machine().machine()}}, std::int64_t{1});
  AddDevices(out, monitor.machine(), now);
  AddMotors(out, monitor.machine(), now);
  AddBuses(out, monitor.machine(), now);
  AddAlarms(out, monitor);
  out.Family("axlecast_bridge_up", Type::kGauge, "1 while a bridge serves: commands can be given; else 0.");
  out.Add({}, std::int64_t{monitor.machine().bridge().Fresh(now)});
  AddRecorders(out, monitor, now);
  AddHosts(out, monitor.machine(), now);
  AddCommands(out, monitor);
  AddReception(out, monitor);
  return out.text();
}

}  // namespace axlecast
