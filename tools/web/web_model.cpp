#include "tools/web/web_model.h"

#include <array>
#include <limits>
#include <utility>

namespace axlecast {
namespace {

constexpr MonoNs kStateLasts = 200 * kMillisecond;
constexpr double kGap = std::numeric_limits<double>::quiet_NaN();

std::string RecorderAlarms(const RecorderView& recorder) { return "recorder/" + recorder.name; }

std::array<double, 3> PositionRow(const DeviceView& device) {
  const position_t& position = *device.position;
  if ((position.flags & position_t::FLAG_VALID) == 0 || position.counts_per_turn <= 0) return {kGap, kGap, kGap};
  const double turns = static_cast<double>(position.counts) / static_cast<double>(position.counts_per_turn);
  return {position.value, turns, device.SpeedRpm()};
}

std::array<double, 7> MotorRow(const motor_health_t& motor) {
  if ((motor.flags & motor_health_t::FLAG_ANALOG_VALID) == 0) return {kGap, kGap, kGap, kGap, kGap, kGap, kGap};
  return {motor.voltage_v,     motor.current_a,     motor.power_w,      motor.temperature_c,
          motor.accel_mps2[0], motor.accel_mps2[1], motor.accel_mps2[2]};
}

}  // namespace

WebModel::WebModel(const MachineConfig& machine, std::string version, std::optional<WebLogFacts> log,
                   std::int64_t clock_id)
    : machine_(machine),
      version_(std::move(version)),
      log_(std::move(log)),
      clock_id_(clock_id),
      monitor_(machine) {}

void WebModel::OnMessage(std::string_view channel, Bytes message, WebTimestamp now) {
  const MonitorUpdate update = monitor_.OnMessage(channel, message, now.mono);
  const std::vector<DeviceView>& devices = monitor_.machine().devices();
  switch (update.kind) {
    case MonitorUpdate::Kind::kPosition: {
      const DeviceView& device = devices[update.index];
      Add(update.index, device.position->utime, device.position->clock_id, PositionRow(device));
      break;
    }
    case MonitorUpdate::Kind::kMotor: {
      const motor_health_t& motor = *devices[update.index].motor;
      Add(update.index, motor.utime, motor.clock_id, MotorRow(motor));
      break;
    }
    case MonitorUpdate::Kind::kDeviceAlarms:
      if (update.changed) PublishAlarms(devices[update.index].name, devices[update.index].alarms, now.utime);
      break;
    case MonitorUpdate::Kind::kBridgeAlarms:
      if (update.changed) PublishAlarms("bridge", monitor_.machine().bridge(), now.utime);
      break;
    case MonitorUpdate::Kind::kRecorderAlarms: {
      const RecorderView& recorder = monitor_.recorders()[update.index];
      if (update.changed) PublishAlarms(RecorderAlarms(recorder), recorder.alarms, now.utime);
      break;
    }
    case MonitorUpdate::Kind::kTrip:
      if (update.changed) Publish(TripFrame(devices[update.index].trips.back()));
      break;
    case MonitorUpdate::Kind::kCommand:
      if (update.changed) Publish(CommandFrame(monitor_.commands().newest()[update.index]));
      break;
    case MonitorUpdate::Kind::kHostTime:
      unix_times_.Update(monitor_.machine(), monitor_.machine().hosts()[update.index], now.mono);
      break;
    default:
      break;
  }
}

const std::string& WebModel::State(WebTimestamp now) {
  // The model of a log has one browser, and its time may be paused.
  if (log_ || state_.empty() || now.mono - state_at_ >= kStateLasts || now.mono < state_at_) {
    state_ = StateFrame(monitor_, now);
    state_at_ = now.mono;
  }
  return state_;
}

std::vector<std::string> WebModel::Past(std::int64_t utime) const {
  std::vector<std::string> frames;
  const auto add = [&frames](const std::string& name, const AlarmView& alarms) {
    const std::int64_t changed = alarms.changes().empty() ? 0 : alarms.changes().back().unix_us;
    if (alarms.received()) frames.push_back(AlarmsFrame(name, alarms, changed, {}));
  };
  for (const DeviceView& device : monitor_.machine().devices()) add(device.name, device.alarms);
  add("bridge", monitor_.machine().bridge());
  for (const RecorderView& recorder : monitor_.recorders()) add(RecorderAlarms(recorder), recorder.alarms);
  for (const DeviceView& device : monitor_.machine().devices()) {
    for (const trip_log_t& trip : device.trips) frames.push_back(TripFrame(trip));
  }
  for (const command_status_t& status : monitor_.commands().newest()) frames.push_back(CommandFrame(status));
  for (std::size_t i = 0; i < monitor_.machine().devices().size(); ++i) {
    const DeviceView& device = monitor_.machine().devices()[i];
    const SampleHistory* history = device.has_position ? nullptr : samples(i);
    if (history != nullptr) frames.push_back(TrendFrame(device.name, columns(i), *history, utime));
  }
  return frames;
}

std::optional<std::size_t> WebModel::IndexOf(std::string_view device) const {
  const DeviceView* const found = monitor_.machine().FindDevice(device);
  if (found == nullptr) return std::nullopt;
  return static_cast<std::size_t>(found - monitor_.machine().devices().data());
}

const SampleHistory* WebModel::samples(std::size_t device) const {
  return device < samples_.size() ? samples_[device].get() : nullptr;
}

std::vector<WebColumn> WebModel::columns(std::size_t device) const {
  return ColumnsOf(monitor_.machine().devices()[device], 0);
}

void WebModel::Add(std::size_t device, std::int64_t utime, std::int64_t clock_id, std::span<const double> row) {
  if (clock_id_ != 0) utime = unix_times_.Convert(utime, clock_id, clock_id_);
  if (device >= samples_.size()) samples_.resize(device + 1);
  if (!samples_[device]) {
    samples_[device] = std::make_unique<SampleHistory>(row.size(), RowsFor(device));
  }
  // An unlisted device may turn out to be of the other kind. Its samples are then ignored.
  if (samples_[device]->columns() == row.size()) samples_[device]->Add(utime, row);
}

std::size_t WebModel::RowsFor(std::size_t device) const {
  const bool unlisted = !machine_.buses.empty() && !monitor_.machine().devices()[device].listed;
  if (unlisted) return kUnlistedRows;
  return device < kManyRows ? kMaxRows : kMaxFurtherRows;
}

void WebModel::Publish(std::string frame) {
  event_bytes_ += frame.size();
  events_.push_back(std::move(frame));
  ++events_end_;
  while (events_.size() > kMaxEvents || (event_bytes_ > kMaxEventBytes && events_.size() > 1)) {
    event_bytes_ -= events_.front().size();
    events_.pop_front();
  }
}

void WebModel::PublishAlarms(const std::string& device, const AlarmView& alarms, std::int64_t utime) {
  std::set<std::string>& names = alarm_names_[device];
  Publish(AlarmsFrame(device, alarms, utime, names));
  names.clear();
  for (const alarm_entry_t& entry : alarms.entries()) names.insert(entry.name);
}

}  // namespace axlecast
