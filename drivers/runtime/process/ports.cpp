#include "drivers/runtime/process/ports.h"

#include <algorithm>
#include <cmath>

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

BusSettings BusSettingsOf(const BusConfig& config, PulseLines* lines) {
  BusSettings settings;
  if (config.poll_hz > 0) settings.schedule.period = std::llround(static_cast<double>(kSecond) / config.poll_hz);
  settings.schedule.phase = config.phase;
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

}  // namespace axlecast
