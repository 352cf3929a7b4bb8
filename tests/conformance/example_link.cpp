#include "tests/conformance/example_link.h"

#include "drivers/runtime/driver/bus_settings.h"

namespace axlecast {

Cable& ExampleLink::cable() {
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

void ExampleLink::PlugInto(DriverPorts& ports) {
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

Bus ExampleLink::MakeBus(const Clock& clock, LinkObserver& observer, WireLog* wire) {
  DriverPorts ports;
  PlugInto(ports);
  const BusSettings settings = BusSettingsOf(bus_, ports.lines);
  if (ports.frames != nullptr) return {settings, *ports.frames, clock, observer, wire};
  return {settings, *ports.link, clock, observer, wire};
}

}  // namespace axlecast
