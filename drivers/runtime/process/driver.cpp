#include "drivers/runtime/process/driver.h"

#include <algorithm>
#include <axlecast/driver_status_t.hpp>
#include <cassert>
#include <utility>

#include "core/alarm/alarm_codes.h"
#include "core/base/secret.h"
#include "core/config/ticks.h"
#include "core/messages/message.h"
#include "drivers/hal/can_socket.h"
#include "drivers/hal/modbus_port.h"
#include "drivers/hal/pulse_lines.h"
#include "drivers/hal/serial_port.h"
#include "drivers/hal/simulated_can.h"
#include "drivers/hal/simulated_spi.h"
#include "drivers/hal/spi_port.h"

namespace axlecast {
namespace {

template <typename Port>
void MakeLine(const BusConfig& bus, const Clock& clock, Ports& ports) {
  SerialSettings settings;
  settings.path = bus.link.port;
  settings.format = bus.link.line;
  settings.pty = {.simulated = bus.simulate, .foreign = bus.link.pty};
  if (bus.simulate) settings.format.parity = Parity::kNone;  // the kernel gives a pty none
  auto port = std::make_unique<Port>(settings, clock);
  ports.warnings = [known = port.get()] { return known->warnings(); };
  ports.link = std::move(port);
}

void MakeCan(const BusConfig& bus, const Clock& clock, Ports& ports) {
  if (bus.simulate) {
    ports.frames = std::make_unique<SimulatedCan>(bus.link.port, bus.link.bitrate, clock);
    return;
  }
  CanSettings settings;
  settings.interface = bus.link.port;
  settings.bitrate = bus.link.bitrate;
  settings.filters = CanFiltersOf(bus);
  auto socket = std::make_unique<CanSocket>(std::move(settings), clock);
  ports.warnings = [known = socket.get()] { return known->warnings(); };
  ports.frames = std::move(socket);
}

void MakeSpi(const BusConfig& bus, const Clock& clock, Ports& ports) {
  if (bus.simulate) {
    ports.link = std::make_unique<SimulatedSpi>(bus.link.port, SpiOf(bus), clock);
  } else {
    ports.link = std::make_unique<SpiPort>(bus.link.port, SpiOf(bus), clock);
  }
}

void MakePulseLines(const MachineConfig& machine, const BusConfig& bus, const Clock& clock, Ports& ports) {
  if (!bus.family_bus || bus.family_bus->lines.empty()) return;
  if (bus.simulate) {
    ports.lines =
        std::make_unique<SimulatedLines>(RunDirectory(machine.machine) + '/' + bus.name + ".lines", clock);
  } else {
    ports.lines = std::make_unique<GpioLines>(bus.family_bus->lines, clock);
  }
}

// A silent device costs the others at most 1/33 of the bus, and less than twice that with the silence that follows.
constexpr int kPauseCosts = 32;

}  // namespace

Ports MakePorts(const MachineConfig& machine, const BusConfig& bus, const Clock& clock) {
  Ports ports;
  switch (bus.family->link) {
    case LinkKind::kSerial:
      MakeLine<SerialPort>(bus, clock, ports);
      break;
    case LinkKind::kModbus:
      MakeLine<ModbusPort>(bus, clock, ports);
      break;
    case LinkKind::kCan:
      MakeCan(bus, clock, ports);
      break;
    case LinkKind::kSpi:
      MakeSpi(bus, clock, ports);
      break;
  }
  MakePulseLines(machine, bus, clock, ports);
  return ports;
}

WireLog::Kind WireKindOf(const BusConfig& config) {
  switch (config.family->link) {
    case LinkKind::kCan:
      return {.kind = wire_t::KIND_CAN, .clock_hz = 0};
    case LinkKind::kSpi:
      return {.kind = wire_t::KIND_SPI, .clock_hz = static_cast<std::int32_t>(SpiOf(config).clock_hz)};
    case LinkKind::kSerial:
    case LinkKind::kModbus:
      return {};
  }
  return {};
}

BusSettings BusSettingsOf(const BusConfig& config, PulseLines* lines, const BaseClaims* base) {
  BusSettings settings;
  settings.schedule.ticks = TicksOf(config);
  settings.schedule.base = base;
  if (config.devices.size() > 1) {
    settings.schedule.pause_max_shared = 2 * kSecond;
    settings.schedule.pause_costs = kPauseCosts;
  }
  if (config.family_bus) settings.schedule.pacing = config.family_bus->pacing;
  settings.schedule.line = config.link.line;
  settings.echo = config.link.echo;
  settings.late = config.late;
  if (!config.simulate) settings.wire = config.link.line;
  settings.lines = lines;
  return settings;
}

bool HoldsSecrets(const BusConfig& config) {
  return std::any_of(config.devices.begin(), config.devices.end(),
                     [](const DeviceConfig& device) { return device.settings && device.settings->holds_secrets; });
}

void DuplicateDriverDetector::OnDriverStatus(Bytes message) {
  const auto status = DecodeMessage<driver_status_t>(message);
  if (!status || status->boot_id == boot_id_) return;
  const bool leaves = status->kind == driver_status_t::KIND_GOODBYE;
  present_until_.store(leaves ? 0 : clock_.Now() + kGoneAfter, std::memory_order_relaxed);
}

namespace {

std::unique_ptr<WireLog> MakeWireLog(const BusConfig& config, const Origin& origin, const Timebase& time,
                                     MessageSink& sink) {
  if (!config.capture) return nullptr;
  return std::make_unique<WireLog>(config.name, origin, time, sink, WireKindOf(config));
}

driver_device_t SummaryOf(const DeviceConfig& config, const DevicePublisher::Summary& summary) {
  driver_device_t device{};
  device.device = config.name;
  device.state = summary.state;
  device.datum_epoch = summary.datum_epoch;
  device.reference_lost = summary.reference_lost ? 1 : 0;
  device.identity = std::string(summary.identity);
  if (summary.datum) {
    device.has_datum = 1;
    device.datum_counts = summary.datum->counts;
    device.datum_utime = summary.datum->unix_us;
  }
  if (summary.position) {
    device.has_position = 1;
    device.position = summary.position->counts;
    device.position_utime = summary.position->unix_us;
  }
  return device;
}

constexpr MonoNs kLateShown = 60 * kSecond;  // how long the alarm stays after the last late reply

// Returns true if more differs than the position, which changes with every reading.
bool Differs(const driver_device_t& sent, const DevicePublisher::Summary& now) {
  const bool same_datum =
      (sent.has_datum != 0) == now.datum.has_value() &&
      (!now.datum || (sent.datum_counts == now.datum->counts && sent.datum_utime == now.datum->unix_us));
  return sent.state != now.state || sent.datum_epoch != now.datum_epoch ||
         (sent.reference_lost != 0) != now.reference_lost || sent.identity != now.identity || !same_datum;
}

}  // namespace

Driver::Driver(const BusConfig& config, const BridgeConfig& bridge, const Origin& origin, DriverPorts ports)
    : config_(config),
      ports_(std::move(ports)),
      base_clock_(origin.clock_id),
      duplicates_(origin.boot_id, *ports_.clock),
      command_server_(config, bridge,
                      {.origin = origin,
                       .clock = ports_.clock,
                       .sink = ports_.commands,
                       .wake = [this] { link().Wake(); },
                       .key = ports_.key,
                       .base = Base()}),
      operations_(*config.family, command_server_, time_, ports_.log),
      wire_(MakeWireLog(config, origin, time_, *ports_.data)),
      held_(*ports_.data),
      bus_(MakeBus()),
      health_(config, origin, time_, *ports_.data),
      holds_secrets_(HoldsSecrets(config)),
      now_(ports_.clock->Now()),
      next_tick_(now_) {
  time_.Update(now_, ports_.clock->UtcMicroseconds());
  if (ports_.frames != nullptr) can_watch_.emplace(config.link.port, config.link.bitrate);
  const DevicePublisherContext context{
      .origin = origin,
      .time = &time_,
      .sink = SinkOfReadings(),
      .on_outcome =
          [this](const std::string& device, const CommandId& id, const Outcome& outcome) {
            held_.Release();  // what led to it comes first
            operations_.OnOutcome(device, id, outcome);
          },
      .base = Base()};
  for (const DeviceConfig& device : config.devices) {
    Unit unit{.config = &device};
    unit.channel = std::make_unique<DevicePublisher>(config, device, context);
    unit.device = config.family->make_device(config, device, *unit.channel, *ports_.secrets);
    operations_.Add(device, *unit.channel, *unit.device);
    bus_.Add(*unit.device);
    units_.push_back(std::move(unit));
  }
  tallies_.resize(units_.size());
  summaries_.resize(units_.size());
}

Bus Driver::MakeBus() {
  const BusSettings settings = BusSettingsOf(config_, ports_.lines, Base());
  if (ports_.frames != nullptr) return {settings, *ports_.frames, *ports_.clock, *this, wire_.get()};
  return {settings, *ports_.link, *ports_.clock, *this, wire_.get()};
}

MessageSink* Driver::SinkOfReadings() {
  if (ports_.link != nullptr && config_.poll_hz == 0) return &held_;
  return ports_.data;
}

Link& Driver::link() const {
  if (ports_.frames != nullptr) return *ports_.frames;
  return *ports_.link;
}

MonoNs Driver::RunOnce() {
  RunStep();
  if (holds_secrets_) WipeStack();
  return now_;
}

std::string Driver::LineTaken() const {
  return !line_held_.empty() && now_ - held_since_ >= kLineHeldFor ? line_held_ : "";
}

void Driver::RunStep() {
  // Nothing is published before it is known whether another driver has the line.
  if (!std::exchange(line_tried_, true)) now_ = bus_.RunOnce(now_);
  if (!line_held_.empty()) next_tick_ = now_ + kTick;
  operations_.Poll(now_);
  if (now_ >= next_tick_) Tick();
  now_ = bus_.RunOnce(next_tick_);
}

void Driver::Stop() {
  operations_.Abandon(now_);
  const MonoNs deadline = now_ + kGrace;
  while (operations_.Busy() && now_ < deadline) RunOnce();
  if (wire_) wire_->Flush();
  ReportHealth();
  operations_.CountWrites();
  command_server_.Goodbye();
  link().Close();
  FlushBlocks();
  held_.Release();
}

// A publisher sends a block only when its first reading is 100 ms old.
void Driver::FlushBlocks() {
  if (std::none_of(units_.begin(), units_.end(), [](const Unit& unit) { return unit.config->block; })) return;
  const MonoNs due = ports_.clock->Now() + kTick;
  while (ports_.clock->Now() < due) static_cast<void>(link().Wait(due));
  for (Unit& unit : units_) unit.channel->Tick(due);
}

void Driver::Tick() {
  FollowUtc();
  WatchDuplicates();
  WatchUnauthorized();
  WatchLateReplies();
  const bool can_changed = WatchCan();
  for (Unit& unit : units_) unit.channel->Tick(now_);
  const bool second = ticks_++ % kTicksPerHello == 0;
  if (second || SummaryChanged()) PublishHello();
  PublishAcknowledged(second);
  if (second || can_changed) ReportHealth();
  next_tick_ += kTick;
  if (next_tick_ <= now_) next_tick_ = now_ + kTick;
}

void Driver::FollowUtc() {
  if (!time_.Update(ports_.clock->Now(), ports_.clock->UtcMicroseconds())) return;
  ports_.log(LogLevel::kWarning, "UNIX time was stepped");
  for (Unit& unit : units_) unit.channel->OnClockStepped();
}

void Driver::WatchDuplicates() {
  const bool present = duplicates_.Present(now_);
  if (present == duplicate_seen_) return;
  duplicate_seen_ = present;
  ports_.log(LogLevel::kWarning,
             present ? "another driver answers for this bus: stop one of the two" : "the other driver is gone");
  RaiseForAll(runtime_alarms::kDuplicateDriver, present);
}

void Driver::WatchUnauthorized() {
  if (!unauthorized_.Update(command_server_.refused(), now_)) return;
  if (unauthorized_.present()) {
    ports_.log(LogLevel::kWarning, std::to_string(command_server_.refused()) +
                                       " commands were refused without an answer: " +
                                       std::string(command_server_.Rule()) + "; find their sender");
  }
  RaiseForAll(runtime_alarms::kUnauthorizedCommand, unauthorized_.present());
}

void Driver::WatchLateReplies() {
  for (std::size_t i = 0; i < units_.size(); ++i) {
    Unit& unit = units_[i];
    const std::int64_t late = bus_.late_replies(i);
    const bool was = unit.late_until > 0;
    if (late != unit.late_replies) unit.late_until = now_ + kLateShown;
    if (now_ >= unit.late_until) unit.late_until = 0;
    unit.late_replies = late;
    const bool is = unit.late_until > 0;
    if (is == was) continue;
    if (is) {
      ports_.log(LogLevel::kWarning,
                 unit.config->name +
                     ": replies come after their timeout and are not used: raise timeout_us, set the "
                     "adapter's latency timer to 1 ms, or spare the computer");
    }
    unit.channel->OnAlarm(runtime_alarms::kLateReplies, is ? AlarmState::kLive : AlarmState::kAbsent, now_);
  }
}

bool Driver::WatchCan() {
  if (!can_watch_) return false;
  const std::int64_t revision = can_watch_->revision();
  const AlarmSpec* const worst = can_watch_->health().worst;
  can_watch_->Update(ports_.frames->Controller(), now_);
  if (can_watch_->revision() == revision) return false;
  for (const CanWatch::Alarm& alarm : can_watch_->alarms()) RaiseForAll(*alarm.spec, alarm.present);
  const CanHealth health = can_watch_->health();
  if (health.worst != nullptr && health.worst != worst) ports_.log(LogLevel::kWarning, health.trouble);
  if (health.worst == nullptr && worst != nullptr) {
    ports_.log(LogLevel::kInfo, config_.link.port + ": the bus has no alarm any more");
  }
  return true;
}

void Driver::RaiseForAll(const AlarmSpec& alarm, bool present) {
  for (Unit& unit : units_) {
    unit.channel->OnAlarm(alarm, present ? AlarmState::kLive : AlarmState::kAbsent, now_);
  }
}

bool Driver::SummaryChanged() const {
  for (std::size_t i = 0; i < units_.size(); ++i) {
    if (Differs(summaries_[i], units_[i].channel->summary())) return true;
  }
  return false;
}

void Driver::PublishHello() {
  for (std::size_t i = 0; i < units_.size(); ++i) {
    summaries_[i] = SummaryOf(*units_[i].config, units_[i].channel->summary());
  }
  command_server_.Hello(summaries_);
}

void Driver::PublishAcknowledged(bool second) {
  for (Unit& unit : units_) {
    const AlarmTable& alarms = unit.channel->alarms();
    const bool changed = alarms.acknowledged_revision() != unit.acknowledged_published;
    if (!changed && (!second || unit.acknowledged_published == 0)) continue;
    unit.acknowledged_published = alarms.acknowledged_revision();
    command_server_.PublishAcknowledged(unit.config->name, alarms.Acknowledged());
  }
}

void Driver::ReportHealth() {
  for (std::size_t i = 0; i < units_.size(); ++i) {
    DeviceTally& tally = tallies_[i];
    tally.device = units_[i].config->name;
    tally.good = units_[i].channel->good();
    for (std::size_t kind = 0; kind < kErrorKinds; ++kind) {
      tally.errors[kind] = units_[i].channel->errors(static_cast<ErrorKind>(kind));
    }
  }
  health_.Publish(now_, bus_, tallies_, can_watch_ ? can_watch_->health() : CanHealth());
}

void Driver::OnSlot(std::size_t device, std::int64_t tick) {
  if (device != kAllDevices) return units_[device].channel->OnTick(tick);
  for (Unit& unit : units_) {
    if (IsReadOnTicks(config_, *unit.config)) unit.channel->OnTick(tick);
  }
}

void Driver::OnLink(bool up, std::string_view reason, MonoNs now) {
  line_held_ = !up && reason.ends_with(kLineHeld) ? std::string(reason) : "";
  if (!line_held_.empty()) {
    held_since_ = now;
    ports_.log(LogLevel::kWarning, reason);
    return;
  }
  if (up) {
    ports_.log(LogLevel::kInfo, "the line is open: " + config_.link.port);
  } else {
    ports_.log(LogLevel::kWarning, reason);
  }
  if (up && ports_.link_warnings) {
    for (const std::string& warning : ports_.link_warnings()) ports_.log(LogLevel::kWarning, warning);
  }
  for (Unit& unit : units_) unit.channel->OnLink(up, reason, now);
}

namespace {

constexpr int kWaitMs = 100;

}  // namespace

CommandThread::CommandThread(LcmPort& port, const BusConfig& config, Driver& driver) : port_(port) {
  // Names contain no special characters of regular expressions.
  [[maybe_unused]] bool subscribed = port_.Subscribe(
      "DRIVER_COMMAND/" + config.name,
      [&driver](const std::string&, Bytes message) { driver.command_server().OnDriverCommand(message); });
  subscribed &= port_.Subscribe(
      "DRIVER_TIME/.*", [&driver](const std::string&, Bytes message) { driver.base_clock().OnTime(message); });
  subscribed &= port_.Subscribe("DRIVER_STATUS/" + config.name, [&driver](const std::string&, Bytes message) {
    driver.duplicates().OnDriverStatus(message);
  });
  for (const DeviceConfig& device : config.devices) {
    subscribed &=
        port_.Subscribe("PERMIT/" + device.name, [&driver, name = device.name](const std::string&, Bytes message) {
          driver.command_server().OnPermit(name, message);
        });
  }
  assert(subscribed);  // the port works, or the driver would not have started
  thread_ = std::thread([this] { Run(); });
}

CommandThread::~CommandThread() {
  ending_ = true;
  thread_.join();
}

void CommandThread::Run() {
  while (!ending_ && !failed_) failed_ = !port_.Handle(kWaitMs);
}

}  // namespace axlecast
