#pragma once

#include "drivers/runtime/bus/bus.h"
#include "drivers/runtime/config/machine_config.h"
#include "drivers/runtime/driver/driver.h"
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

  [[nodiscard]] Cable& cable();
  // The bus on it, without devices.
  [[nodiscard]] Bus MakeBus(const Clock& clock, LinkObserver& observer, WireLog* wire);
  // Puts it where a driver finds it.
  void PlugInto(DriverPorts& ports);

 private:
  const BusConfig& bus_;
  SimulatorLink line_;  // one of these three
  SimulatorFrameLink frames_;
  SimulatorSpiLink spi_;
};

}  // namespace axlecast
