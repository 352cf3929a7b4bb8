#pragma once

#include <array>
#include <memory>
#include <string>

#include "core/config/config_map.h"
#include "core/config/machine_config.h"
#include "core/device/family.h"

// Two families for the tests of the configuration: "point" is point to point, "ring" holds up to four slow devices.
namespace axlecast::test_family {

struct Settings final : DeviceSettings {
  std::vector<std::uint8_t> tag;
};

template <MonoNs kWireTime>
std::unique_ptr<DeviceSettings> Parse(ConfigMap& device, const BusConfig& bus) {
  auto settings = std::make_unique<Settings>();
  const bool multi_turn = device.Choice("model", {"st17", "mt17"}, 1) == 1;
  settings->model = multi_turn ? "mt17" : "st17";
  settings->counts_per_turn = 131'072;
  settings->turns_range = multi_turn ? 65'536 : 0;
  settings->max_speed_rpm = 6'000;
  settings->max_accel_rad_s2 = 80'000;
  settings->wire_time = kWireTime * bus.family->default_line.baud / bus.link.line.baud;
  settings->tag = device.HexBytes("tag");
  return settings;
}

class Nothing final : public Simulator {
 public:
  void OnBytes(Bytes, MonoNs, const Transmit&) override {}
  [[nodiscard]] MonoNs NextDue() const override { return kNever; }
  void OnDue(MonoNs, const Transmit&) override {}
  [[nodiscard]] Result<> Set(std::string_view, std::string_view, std::string_view, MonoNs) override { return {}; }
  [[nodiscard]] std::vector<std::pair<std::string, std::string>> State(std::string_view, MonoNs) const override {
    return {};
  }
};

inline std::unique_ptr<Simulator> Simulate(const BusConfig&, ConfigMap& keys) {
  static_cast<void>(keys.Number("speed_rpm", 0, -6'000, 6'000, "rpm"));
  return std::make_unique<Nothing>();
}

inline std::span<const OperationSpec> Operations() {
  static const std::array<OperationSpec, 4> operations = {
      OperationSpec{.name = "look", .help = "", .reads_only = true}, OperationSpec{.name = "mark", .help = ""},
      OperationSpec{.name = "zero", .help = "", .destructive = true},
      OperationSpec{.name = "hidden", .help = "", .internal = true}};
  return operations;
}

inline std::span<const Family* const> Table() {
  static const Family point{.name = "point",
                            .summary = "",
                            .default_line = {.baud = 2'500'000},
                            .max_devices_per_bus = 1,
                            .operations = Operations(),
                            .parse = &Parse<51 * kMicrosecond>,
                            .make_simulator = &Simulate};
  static const Family ring{.name = "ring",
                           .summary = "",
                           .default_line = {.baud = 9'600},
                           .max_devices_per_bus = 4,
                           .operations = {},
                           .parse = &Parse<10 * kMillisecond>,
                           .make_simulator = &Simulate};
  static const std::array<const Family*, 2> table = {&point, &ring};
  return table;
}

// One bus with one device; the bus's own keys begin in line 5, the device's after them.
inline std::string Machine(const std::string& bus, const std::string& device) {
  return "machine: press3\n"
         "buses:\n"
         "  b0:\n"
         "    family: point\n"
         "    " +
         bus +
         "\n"
         "    devices: {axis1: {" +
         device + "}}\n";
}

}  // namespace axlecast::test_family
