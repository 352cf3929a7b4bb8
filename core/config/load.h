#pragma once

#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <string_view>

#include "core/config/config_file.h"
#include "core/config/config_map.h"
#include "core/config/includes.h"
#include "core/config/machine_config.h"

namespace axlecast {

// Reads and checks the machine's file, and reports all errors at once. Returns nothing if there is an error. A driver knows
// only its own family: with `only_bus`, the other buses and their devices are not checked and not in the result.
[[nodiscard]] std::optional<MachineConfig> LoadConfig(const std::string& file, ConfigErrors& errors,
                                                      std::string_view only_bus = {},
                                                      ConfigWriters writers = ConfigWriters::kOwner);
// The same of a text in memory, which cannot include files: `include` is an error.
[[nodiscard]] std::optional<MachineConfig> ParseConfig(const std::string& text, ConfigErrors& errors,
                                                       std::string_view only_bus = {});

// The same of a file and the files that it includes, as `read` returns them.
[[nodiscard]] std::optional<MachineConfig> LoadConfigFrom(const std::string& file, const ConfigReader& read,
                                                          ConfigErrors& errors, std::string_view only_bus = {});

// Makes the simulators of a machine's buses by the keys of their `simulate`. Parses the file's text once for all buses.
class SimulatorMaker {
 public:
  // Both must outlive the maker.
  SimulatorMaker(const MachineConfig& machine, ConfigErrors& errors);
  // Returns null after an error.
  [[nodiscard]] std::unique_ptr<Simulator> Make(const BusConfig& bus);

 private:
  ConfigErrors* errors_;
  std::map<std::string, ConfigMap, std::less<>> buses_;
};

// The same for one bus.
[[nodiscard]] inline std::unique_ptr<Simulator> MakeSimulator(const MachineConfig& machine, const BusConfig& bus,
                                                              ConfigErrors& errors) {
  return SimulatorMaker(machine, errors).Make(bus);
}

// ---- sections of the file ----

// Returns the key of `link` that names the line: port, iface or spidev.
[[nodiscard]] const char* LinkKey(LinkKind kind);

// Reads `link` for the family's kind of line. A simulated bus has its pty or socket at `place`, with a suffix of its kind.
[[nodiscard]] LinkConfig LoadLink(ConfigMap map, const Family& family, bool simulate, const std::string& place);

// Reads one entry of a bus's `devices`: the keys of every device, then those of its family. `bus` has the bus's own keys.
[[nodiscard]] DeviceConfig LoadDevice(const std::string& name, ConfigMap& map, const BusConfig& bus);

// The machine's devices by name; null where their family is unknown here.
using DeviceFamilies = std::map<std::string, const Family*, std::less<>>;

// Reads `bridge`: who may command which devices, and with which keys.
[[nodiscard]] BridgeConfig LoadBridge(ConfigMap map, const DeviceFamilies& devices);

}  // namespace axlecast
