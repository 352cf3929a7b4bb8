#pragma once

#include "core/config/machine_config.h"
#include "drivers/runtime/bus/bus.h"
#include "drivers/runtime/process/driver.h"
#include "tests/support/simulator_frame_link.h"
#include "tests/support/simulator_link.h"
#include "tests/support/simulator_spi_link.h"

namespace axlecast {

// The line of a bus in virtual time, of the kind that its family needs.
class ExampleLink {
 public:
  ExampleLink(const BusConfig& bus, FakeClock& clock, Simulator& simulator)
      : bus_(bus),
        line_(clock, simulator, bus.link.line.baud),
        frames_(clock, simulator, bus.link.bitrate),
        spi_(clock, simulator, SpiOf(bus)) {}

  [[nodiscard]] Cable& cable() {
    switch (bus_.family->link) {
      case LinkKind::kCan:
        return frames_;
      case LinkKind::kSpi:
        return spi_;
      case LinkKind::kSerial:
      case LinkKind::kModbus:
        break;
    }
    return line_;
  }

  // Puts it where a driver finds it.
  void PlugInto(DriverPorts& ports) {
    switch (bus_.family->link) {
      case LinkKind::kCan:
        ports.frames = &frames_;
        return;
      case LinkKind::kSpi:
        ports.link = &spi_;
        return;
      case LinkKind::kSerial:
      case LinkKind::kModbus:
        ports.link = &line_;
        ports.lines = &line_;
    }
  }

  // The bus on it, without devices.
  [[nodiscard]] Bus MakeBus(const Clock& clock, BusObserver& observer, WireLog* wire) {
    DriverPorts ports;
    PlugInto(ports);
    const BusSettings settings = BusSettingsOf(bus_, ports.lines);
    if (ports.frames != nullptr) return {settings, *ports.frames, clock, observer, wire};
    return {settings, *ports.link, clock, observer, wire};
  }

 private:
  const BusConfig& bus_;
  SimulatorLink line_;  // one of these three
  SimulatorFrameLink frames_;
  SimulatorSpiLink spi_;
};

}  // namespace axlecast
